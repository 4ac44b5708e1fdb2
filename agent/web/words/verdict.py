"""What the engine decides, in German: templates by what was decided, filled with its numbers.

English is the engine's own: its sentence stands on the English page as it was said. German is made
of the verdict's facts (`agent.conclude.facts`), the advice's words (`agent.report.advice`) and the
preconditions' names, never of an English sentence.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

SAID: Mapping[str, str] = MappingProxyType(
    {
        "no-cycle": "Noch nicht entscheidbar: Kein Test ist verwendbar.",
        "too-few": "Noch nicht entscheidbar: {healthy} von {needed} gesunden Tests.",
        "detector-unable": (
            "Noch nicht entscheidbar: Mit dieser Referenz lässt sich kein Urteil bilden."
        ),
        "baseline-complete": (
            "Die Referenz aus {healthy} gesunden Tests ist vollständig; der nächste Test wird als "
            "erster beurteilt."
        ),
        "as-before": (
            "Kein Alarm, die Reibung ist wie zuvor: {low} bei niedriger, {high} bei hoher "
            "Geschwindigkeit, verglichen {at} mit {healthy} gesunden Tests."
        ),
        "moved": (
            "Kein Alarm, doch die Reibung ist {moved} als zuvor: {low} bei niedriger, {high} bei "
            "hoher Geschwindigkeit, verglichen {at} mit {healthy} gesunden Tests."
        ),
        "increased": (
            "Die Reibung ist gestiegen: {low} bei niedriger, {high} bei hoher Geschwindigkeit"
            "{since}, verglichen {at}; {why}.{between}"
        ),
        "increased-a-lot": (
            "Die Reibung ist stark gestiegen: {low} bei niedriger, {high} bei hoher "
            "Geschwindigkeit{since}, verglichen {at}; {why}.{between}"
        ),
        "rising": (
            "Die Reibung steigt seit dem ersten Test: {since_first} bei niedriger Geschwindigkeit "
            "in {cycles} Tests; es gibt keine gesunde Zeit zum Vergleich; {why}."
        ),
        "rising-a-lot": (
            "Die Reibung steigt seit dem ersten Test und ist nun hoch: {since_first} bei niedriger "
            "Geschwindigkeit in {cycles} Tests; es gibt keine gesunde Zeit zum Vergleich; {why}."
        ),
        "unsettled": (
            "Kein Alarm, doch die Referenz steht noch nicht: Die Reibung ist über ihre {cycles} "
            "Tests gefallen ({since_first} bei niedriger Geschwindigkeit), wie bei einem neuen "
            "Getriebe, das einläuft; ein Anstieg um weniger als das bleibt vielleicht unbemerkt."
        ),
    }
)
"""By `agent.conclude.facts.SAID`."""

MOVED = MappingProxyType({"higher": "höher", "lower": "niedriger"})

CAUSES: Mapping[str, tuple[str, str]] = MappingProxyType(
    {
        "wear": (
            "Verschleiß im Getriebe",
            "Heute Nacht einen zweiten Test bei gleicher Temperatur fahren; bleibt der Anstieg, "
            "eine Fettprobe nehmen und auf Metall prüfen.",
        ),
        "oil": (
            "ein anderer, dickerer oder gealterter Schmierstoff",
            "Klären, ob Öl oder Fett gewechselt oder ergänzt wurde, und es als Ereignis eintragen; "
            "sonst Füllstand und Alter des Schmierstoffs prüfen und eine Probe nehmen.",
        ),
        "temperature": (
            "eine andere Getriebetemperatur als die gemessene",
            "Den Temperatursensor des Getriebes prüfen und einen zweiten Test bei einer Temperatur "
            "fahren, die die Referenz kennt.",
        ),
        "payload": (
            "eine andere Last als die angegebene",
            "Einen zweiten Test ohne Last fahren, oder mit der Last der Referenz.",
        ),
        "measurement": (
            "die Drehmomentmessung",
            "Kalibrierung des Stromsensors und Wicklungstemperatur mit denen der Referenz "
            "vergleichen und einen zweiten Test mit kaltem Motor fahren.",
        ),
        "other": (
            "etwas von anderer Form, etwa ein nicht eingetragener Tausch",
            "Prüfen, ob Getriebe, Arm oder Antrieb getauscht wurden, es als Ereignis eintragen und "
            "einen zweiten Test fahren.",
        ),
    }
)
"""A cause, and what to do about it; by the ids of `agent.monitor.verdict.reasons`."""

ADVICE: Mapping[str, tuple[str, str]] = MappingProxyType(
    {
        "rate": (
            "Die Abtastrate reicht nicht.",
            "Schneller aufzeichnen: mindestens 100 Messwerte je Sekunde, besser 500, jeder mit "
            "seiner eigenen Zeit.",
        ),
        "motion": (
            "Es gibt zu wenig Bewegung.",
            "Prüfen, ob diese Achse gefahren wurde: freigegeben, eingeschaltet, und die richtige.",
        ),
        "torque": (
            "Das Drehmoment ist unbrauchbar.",
            "Den Drehmomentkanal prüfen: welches Objekt des Antriebs, seine Skala, seine Rate.",
        ),
        "saturation": (
            "Das Drehmoment ist an einer Grenze abgeschnitten.",
            "Sanfter fahren, damit das Moment unter der Grenze des Antriebs bleibt: zuerst weniger "
            "Beschleunigung.",
        ),
        "units": (
            "Lage, Geschwindigkeit oder Übersetzung passen nicht zusammen.",
            "Einheiten, Übersetzung und Geberstriche prüfen: Zeit sind Sekunden, Lagen Radiant der "
            "Motorseite.",
        ),
        "directions": (
            "Es fehlt eine der beiden Richtungen.",
            "Beide Richtungen fahren: jede Geschwindigkeit vorwärts und rückwärts über dieselben "
            "Armlagen.",
        ),
        "steady": (
            "Es fehlen stationäre Abschnitte.",
            "Die Treppe fahren: etwa zwanzig Geschwindigkeiten, jede gehalten, bis Moment und "
            "Geschwindigkeit stehen.",
        ),
        "temperature": (
            "Die Getriebetemperatur passt nicht.",
            "Das Getriebe zuerst auf Betriebstemperatur bringen; das Aufwärmprogramm tut das.",
        ),
        "loss": (
            "Es fehlen Messwerte.",
            "Klären, warum Messwerte verloren gingen (Buslast, Verdrahtung, ein anderes Programm).",
        ),
        "again": (
            "",
            "Dann diese Achse neu aufzeichnen und auswerten. Die Aufzeichnung kann bleiben.",
        ),
    }
)
"""What a recording lacks, and what to do about it; by the ids of `agent.report.advice`."""

REFUSED: Mapping[str, str] = MappingProxyType(
    {
        "commissioned": (
            "Die Achse ist nicht freigegeben: Eine verantwortliche Person muss die Grenzen prüfen "
            "und das in der Zelle eintragen."
        ),
        "payload confirmed": "Niemand hat angegeben, was der Arm trägt: payload_kg eintragen.",
        "inside limits": "Was gefahren würde, passt nicht in die Grenzen der Achse.",
        "disk space": "Für Aufzeichnung und Reserve ist kein Platz, oder der Ordner ist gesperrt.",
        "no other owner": "Ein anderes Programm hält die Achse: zuerst dieses beenden.",
        "nothing else runs": "Es läuft bereits ein Test dieser Seite.",
        "release present": "Die Zelle gibt die Achse nicht frei.",
        "operating mode": "Der Roboter ist nicht im Automatikbetrieb.",
        "no stop active": "Ein Halt ist aktiv.",
        "identity": "Am Bus antwortet niemand, oder ein anderer Antrieb als erwartet.",
        "drive healthy": "Der Antrieb meldet einen Fehler, oder jemand hat ihn eingeschaltet.",
        "limits of the drive": (
            "Der Antrieb hat engere Grenzen als das Fenster der Zelle: Geberstriche, Übersetzung, "
            "Drehsinn und Nullpunkt prüfen."
        ),
        "units of the drive": (
            "Der Antrieb zählt in anderen Einheiten als bei der letzten Fahrt der Achse: "
            "Übersetzung, Vorschub und Drehsinn prüfen."
        ),
        "nobody else at work": "Jemand anderes am Bus treibt oder überwacht diesen Antrieb.",
        "settings read back equal": "Der Antrieb passt nicht zur Beschreibung der Zelle.",
        "answers SYNC": "Der Antrieb antwortet nicht.",
        "without torque": "Der Antrieb hat Moment, obwohl ihn niemand eingeschaltet hat.",
        "at standstill": "Die Achse bewegt sich.",
        "inside its window": "Der Arm steht außerhalb seines Fensters: zuerst hineinfahren.",
        "gearbox temperature": "Die Getriebetemperatur ist unbekannt oder außerhalb der Grenzen.",
        "watchdog proven": "Die Überwachung des Antriebs wirkt nicht.",
    }
)
"""A precondition that does not hold, by its name; the engine's own reason follows in English."""
