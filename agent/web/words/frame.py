"""Words around everything: navigation, log-in, users, failures."""

from __future__ import annotations

FRAME_WORDS: dict[str, tuple[str, str]] = {
    "stop": ("Stop test (not an E-stop)", "Test stoppen (kein Not-Halt)"),
    "stop_hint": ("or press Esc", "oder Esc drücken"),
    "stop_sent": (
        "Stop has been asked for: the joint is being brought to rest.",
        "Stopp ist angefordert: Die Achse wird zum Stillstand gebracht.",
    ),
    "stop_failed": (
        "THE STOP DID NOT GET THROUGH. Use the E-stop.",
        "DER STOPP KAM NICHT DURCH. Not-Halt benutzen!",
    ),
    "stop_elsewhere": (
        "Another program's test is asked to stop: {who}.",
        "Der Test eines anderen Programms soll stoppen: {who}.",
    ),
    "stop_of_others": (
        "Another program's test could not be asked to stop: it is another user's. Use the E-stop.",
        "Der Test eines anderen Benutzers ließ sich nicht stoppen. Not-Halt benutzen!",
    ),
    "no_estop": (
        "This stop is no safety function. The E-stop is the red button at the robot.",
        "Dieser Stopp ist keine Sicherheitsfunktion. Der Not-Halt ist der rote Taster am Roboter.",
    ),
    "nothing_runs": ("No test is running.", "Es läuft kein Test."),
    "navigation": ("Main", "Haupt"),
    "menu": ("Menu", "Menü"),
    "cell": ("Cell", "Zelle"),
    "running": ("Running", "Lauf"),
    "alarms": ("Alarms", "Alarme"),
    "users": ("Users", "Benutzer"),
    "audit": ("Audit trail", "Protokoll"),
    "lock_now": ("Lock", "Sperren"),
    "log_in": ("Log in", "Anmelden"),
    "log_out": ("Log out", "Abmelden"),
    "unlock": ("Unlock", "Entsperren"),
    "session_locked": ("Session locked", "Sitzung gesperrt"),
    "session_locked_hint": (
        "Nobody has used the page for a while, or it was locked. Say your password to go on. "
        "The stop works all the same.",
        "Die Seite wurde eine Weile nicht benutzt oder gesperrt. Bitte Passwort eingeben. "
        "Der Stopp wirkt trotzdem.",
    ),
    "login_wrong": (
        "Name and password do not fit together.",
        "Name und Passwort passen nicht zusammen.",
    ),
    "login_wait": (
        "Too many tries. Wait {time}.",
        "Zu viele Versuche. Bitte {time} warten.",
    ),
    "login_help": (
        "No password yet, or forgotten? An engineer makes a one-time token for you.",
        "Noch kein Passwort, oder vergessen? Ein Ingenieur erstellt ein Einmal-Token.",
    ),
    "have_token": ("I have a token", "Ich habe ein Token"),
    "name": ("Name", "Name"),
    "password": ("Password", "Passwort"),
    "password_again": ("Password, once more", "Passwort wiederholen"),
    "password_hint": (
        "At least 10 characters; several words are easy to keep and hard to guess.",
        "Mindestens 10 Zeichen; mehrere Wörter merkt man sich leicht und errät sie schwer.",
    ),
    "welcome": ("Welcome", "Willkommen"),
    "welcome_first": (
        "Nobody can log in yet. The terminal in which the page was started shows a one-time "
        "token: it makes the first user, an engineer.",
        "Noch kann sich niemand anmelden. Das Terminal, in dem die Seite gestartet wurde, zeigt "
        "ein Einmal-Token: Es legt den ersten Benutzer an, einen Ingenieur.",
    ),
    "welcome_invited": (
        "With a one-time token from an engineer you choose your own password.",
        "Mit einem Einmal-Token von einem Ingenieur wählen Sie Ihr eigenes Passwort.",
    ),
    "token": ("One-time token", "Einmal-Token"),
    "name_hint": (
        "Letters, digits, point, dash.",
        "Buchstaben, Ziffern, Punkt, Strich.",
    ),
    "name_hint_invited": (
        "May stay empty: the token knows your name.",
        "Darf leer bleiben: Das Token kennt Ihren Namen.",
    ),
    "begin": ("Begin", "Los"),
    "role": ("Role", "Rolle"),
    "role_viewer": ("Viewer: sees everything", "Betrachter: sieht alles"),
    "role_technician": (
        "Technician: starts cycles, acknowledges alarms",
        "Techniker: startet Tests, quittiert Alarme",
    ),
    "role_engineer": (
        "Engineer: also baselines, users, audit trail",
        "Ingenieur: auch Referenzen, Benutzer, Protokoll",
    ),
    "since": ("since {date}", "seit {date}"),
    "disabled": ("disabled", "gesperrt"),
    "disable": ("Disable", "Sperren"),
    "invite": ("Invite somebody", "Jemanden einladen"),
    "invite_hint": (
        "Makes a one-time token. For somebody who is here already it is a new password.",
        "Erstellt ein Einmal-Token. Für vorhandene Benutzer ist es ein neues Passwort.",
    ),
    "make_token": ("Make a token", "Token erstellen"),
    "token_for": ("Token for {name}", "Token für {name}"),
    "token_hint": (
        "Shown only now. Good for 24 hours, once, at /welcome.",
        "Nur jetzt sichtbar. Gilt 24 Stunden, einmal, unter /welcome.",
    ),
    "audit_hint": (
        "The newest 200 entries. Each carries the hash of the one before; this checks the chain:",
        "Die neuesten 200 Einträge. Jeder trägt den Hash des vorigen; die Kette prüft:",
    ),
    "time": ("Time", "Zeit"),
    "who": ("Who", "Wer"),
    "what": ("What", "Was"),
    "details": ("Details", "Einzelheiten"),
    "problem": ("Not possible", "Nicht möglich"),
    "to_cell": ("To the cell", "Zur Zelle"),
    "log_in_first": ("Log in first.", "Bitte zuerst anmelden."),
    "form_not_ours": (
        "This form is out of date or not from this page. Open the page again.",
        "Dieses Formular ist veraltet oder nicht von dieser Seite. Bitte neu öffnen.",
    ),
    "not_your_role": ("Your role may not do this.", "Ihre Rolle darf das nicht."),
    "not_there": ("There is nothing here.", "Hier ist nichts."),
    "too_large": ("That is more than this page takes.", "Das ist mehr, als diese Seite annimmt."),
    "form_unusable": (
        "Something in this request is missing or cannot be used.",
        "In dieser Anfrage fehlt etwas, oder etwas ist unbrauchbar.",
    ),
    "not_possible": ("That is not possible now.", "Das ist jetzt nicht möglich."),
    "our_fault": (
        "This is a fault of the page's own. The running cycle is not touched by it.",
        "Das ist ein Fehler der Seite selbst. Ein laufender Test ist davon nicht betroffen.",
    ),
    "too_many_viewers": ("Too many are watching.", "Es sehen zu viele zu."),
    "confirm_first": ("Confirm first, then start.", "Zuerst bestätigen, dann starten."),
    "already_running": ("A cycle is running already.", "Es läuft bereits ein Test."),
    "preconditions_refuse": (
        "Not started: a precondition does not hold.",
        "Nicht gestartet: Eine Voraussetzung ist nicht erfüllt.",
    ),
    "no_baseline": (
        "Only a decidable cycle that ran to its end can be a baseline.",
        "Nur ein auswertbarer, vollständiger Test kann Referenz sein.",
    ),
    "cannot_be_made": ("This file cannot be made here.", "Diese Datei lässt sich nicht erstellen."),
    "note_first": ("Write a note first.", "Bitte zuerst eine Notiz schreiben."),
    "acknowledged_already": (
        "Somebody has acknowledged it already.",
        "Jemand hat ihn bereits quittiert.",
    ),
}
