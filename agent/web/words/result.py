"""Words of a result, of an axis's history and of its alarms."""

from __future__ import annotations

RESULT_WORDS: dict[str, tuple[str, str]] = {
    "result": ("Result", "Ergebnis"),
    "history": ("History", "Verlauf"),
    "kind_alarm": ("Alarm", "Alarm"),
    "kind_undecidable": ("Not decidable", "Nicht auswertbar"),
    "kind_stopped": ("Stopped early", "Vorzeitig gestoppt"),
    "kind_unestimated": ("Not estimated", "Nicht ausgewertet"),
    "kind_baseline": ("Baseline", "Referenz"),
    "kind_measured": ("Measured", "Gemessen"),
    "kind_as_before": ("As the baseline", "Wie die Referenz"),
    "kind_unclear": ("Not clear", "Unklar"),
    "kind_changed": ("Different", "Verändert"),
    "finding_undecidable": (
        "The recording does not carry a friction estimate.",
        "Die Aufzeichnung trägt keine Aussage über die Reibung.",
    ),
    "finding_stopped": (
        "The cycle was stopped before its end.",
        "Der Test wurde vor seinem Ende gestoppt.",
    ),
    "finding_unestimated": (
        "There is a recording, but no estimate of it.",
        "Es gibt eine Aufzeichnung, aber keine Auswertung.",
    ),
    "finding_baseline": (
        "Friction was measured: later cycles are held against this one.",
        "Die Reibung ist gemessen: Spätere Tests werden mit diesem verglichen.",
    ),
    "finding_measured": (
        "Friction was measured. There is no baseline to hold it against.",
        "Die Reibung ist gemessen. Es gibt keine Referenz zum Vergleich.",
    ),
    "finding_as_before": (
        "Friction is within 5 % of the baseline of {date}: {percent} % (± {half} %).",
        "Die Reibung liegt innerhalb von 5 % der Referenz vom {date}: {percent} % (± {half} %).",
    ),
    "finding_unclear": (
        "This cycle does not tell whether friction has changed since {date}: {percent} % "
        "(± {half} %).",
        "Dieser Test sagt nicht, ob sich die Reibung seit {date} geändert hat: {percent} % "
        "(± {half} %).",
    ),
    "finding_more": (
        "Friction is {percent} % (± {half} %) higher than in the baseline of {date}.",
        "Die Reibung ist {percent} % (± {half} %) höher als in der Referenz vom {date}.",
    ),
    "finding_less": (
        "Friction is {percent} % (± {half} %) lower than in the baseline of {date}.",
        "Die Reibung ist {percent} % (± {half} %) niedriger als in der Referenz vom {date}.",
    ),
    "by_history": ("By its history", "Nach seinem Verlauf"),
    "what_next": ("What next", "Wie weiter"),
    "why": ("Why", "Warum"),
    "next_alarm": (
        "Look at the alarm, acknowledge it with a note, and plan an inspection of this gearbox.",
        "Alarm ansehen, mit Notiz quittieren, und eine Prüfung dieses Getriebes einplanen.",
    ),
    "next_undecidable": (
        "Read the reasons above and drive the stair once more.",
        "Gründe oben lesen und die Treppe noch einmal fahren.",
    ),
    "next_stopped": (
        "Clear the reason, then start the cycle again.",
        "Grund beseitigen, dann den Test neu starten.",
    ),
    "next_unestimated": (
        "Run `stribeck estimate` on the recording to see why.",
        "Mit `stribeck estimate` nachsehen, warum.",
    ),
    "next_baseline": (
        "Nothing to do. Repeat the cycle regularly, at a similar gearbox temperature.",
        "Nichts zu tun. Test regelmäßig wiederholen, bei ähnlicher Getriebetemperatur.",
    ),
    "next_measured": (
        "Nothing to do. An engineer may make this cycle the baseline.",
        "Nichts zu tun. Ein Ingenieur kann diesen Test zur Referenz machen.",
    ),
    "next_as_before": (
        "Nothing to do. The next cycle comes as planned.",
        "Nichts zu tun. Der nächste Test kommt wie geplant.",
    ),
    "next_unclear": (
        "Drive the stair once more; a longer one has narrower intervals.",
        "Treppe noch einmal fahren; eine längere hat engere Intervalle.",
    ),
    "next_changed": (
        "Repeat the cycle at the baseline's gearbox temperature before you conclude anything: "
        "one cycle is no alarm.",
        "Test bei der Getriebetemperatur der Referenz wiederholen, bevor Sie Schlüsse ziehen: "
        "Ein einzelner Test ist kein Alarm.",
    ),
    "next_temperature": (
        "The gearbox was {k} K against the baseline: a colder gearbox has more friction.",
        "Das Getriebe war {k} K gegenüber der Referenz: Ein kälteres hat mehr Reibung.",
    ),
    "next_temperature_unknown": (
        "The gearbox temperature is not known in both cycles: it alone can make this difference.",
        "Die Getriebetemperatur ist nicht für beide Tests bekannt: Sie allein kann das bewirken.",
    ),
    "friction_curve": ("Friction curve", "Reibkurve"),
    "friction": ("Friction", "Reibung"),
    "this_cycle": ("this cycle", "dieser Test"),
    "baseline": ("Baseline", "Referenz"),
    "baseline_of": ("baseline of {date}", "Referenz vom {date}"),
    "band": ("95 % interval", "95-%-Intervall"),
    "motor_velocity": ("Motor velocity", "Motorgeschwindigkeit"),
    "curve_alt": (
        "Friction torque over motor velocity; the table below has its numbers.",
        "Reibmoment über der Motorgeschwindigkeit; die Tabelle darunter hat die Zahlen.",
    ),
    "difference": ("Difference to the baseline", "Abweichung von der Referenz"),
    "difference_alt": (
        "Difference of friction torque to the baseline over motor velocity.",
        "Abweichung des Reibmoments von der Referenz über der Motorgeschwindigkeit.",
    ),
    "low_speeds": ("Slow half", "Langsame Hälfte"),
    "high_speeds": ("Fast half", "Schnelle Hälfte"),
    "as_table": ("As a table", "Als Tabelle"),
    "quality": ("Quality", "Güte"),
    "residual_curve": ("Residual of the law", "Rest der Reibkurve"),
    "residual_motion": ("Residual in motion", "Rest in Bewegung"),
    "fit": ("Fit", "Übereinstimmung"),
    "samples": ("Samples", "Messwerte"),
    "samples_lost": ("Samples lost", "Verlorene Messwerte"),
    "sample_rate": ("Sample rate", "Abtastrate"),
    "files": ("Report and raw data", "Bericht und Rohdaten"),
    "open_report": ("Open the report", "Bericht öffnen"),
    "download_html": ("Download HTML", "HTML herunterladen"),
    "explanation": ("Explanation", "Erklärung"),
    "make_baseline": ("Make this the baseline", "Als Referenz verwenden"),
    "history_of": ("Axis {n} over time", "Achse {n} im Verlauf"),
    "coulomb": ("Coulomb friction", "Coulomb-Reibung"),
    "viscous": ("Viscous friction", "Viskose Reibung"),
    "each_cycle": ("each cycle, 95 %", "jeder Test, 95 %"),
    "trend_alt": (
        "Trend over the cycles; the list below has each one.",
        "Verlauf über die Tests; die Liste darunter hat jeden einzelnen.",
    ),
    "trend_hint": (
        "As measured: not corrected for temperature.",
        "Wie gemessen: nicht auf die Temperatur korrigiert.",
    ),
    "no_trend": (
        "A trend needs two decidable cycles.",
        "Ein Verlauf braucht zwei auswertbare Tests.",
    ),
    "cycles": ("Cycles", "Tests"),
    "event": ("event", "Ereignis"),
    "events": ("Events", "Ereignisse"),
    "no_events": ("None noted.", "Keine notiert."),
    "event_swap": ("Gearbox or motor swapped", "Getriebe oder Motor getauscht"),
    "event_oil-change": ("Oil changed", "Öl gewechselt"),
    "event_relubrication": ("Relubricated", "Nachgeschmiert"),
    "event_other": ("Other work", "Andere Arbeit"),
    "note_event": ("Note an event", "Ereignis notieren"),
    "what_was_done": ("What was done", "Was wurde getan"),
    "note": ("Note", "Notiz"),
    "keep": ("Keep", "Festhalten"),
    "no_alarms": ("No alarms.", "Keine Alarme."),
    "alarm_note": ("What you saw, what will be done", "Was Sie sahen, was geschehen wird"),
    "acknowledge": ("Acknowledge", "Quittieren"),
    "acknowledged_by": ("Acknowledged by {who}, {date}", "Quittiert von {who}, {date}"),
    "just_now": ("just now", "gerade eben"),
    "ago_minutes": ("{n} min ago", "vor {n} min"),
    "ago_hours": ("{n} h ago", "vor {n} h"),
    "ago_days": ("{n} days ago", "vor {n} Tagen"),
    "never": ("never", "nie"),
}
