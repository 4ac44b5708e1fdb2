"""`stribeck prove`: concealed cases made, explained and scored."""
