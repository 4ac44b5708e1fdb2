"""An event as a mail: SMTP, encrypted by STARTTLS before a password or a word leaves."""

from __future__ import annotations

import smtplib
import ssl
from dataclasses import dataclass
from email.headerregistry import Address
from email.message import EmailMessage
from email.utils import format_datetime, make_msgid
from pathlib import Path

from agent.errors import InputError
from agent.night.clock import MachineClock
from agent.night.description import Email
from agent.night.telling import ByDescription, UndeliveredError, subject, trust
from agent.record.events_file import Event


@dataclass(frozen=True)
class MailSink(ByDescription):
    """One mail server, and to whom it shall pass the mails on.

    Parameters
    ----------
    described : Email
    password : str
        Empty: nobody logs in.
    folder : pathlib.Path
        What `ca_file` is relative to.
    """

    described: Email
    password: str
    folder: Path

    def __post_init__(self) -> None:
        if self.described.user and not self.described.starttls:
            raise InputError(
                "A mail server that asks for a password needs starttls = true: the password would "
                "go over the line for everybody to read."
            )
        try:
            mail_of(Event("", "test", "", ""), self.described).as_bytes()
        except (ValueError, IndexError, AttributeError) as error:
            who = ", ".join((self.described.sender, *self.described.to))
            raise InputError(f"A mail from and to {who} cannot be made: {error}.") from error

    @property
    def name(self) -> str:
        """Return server and receivers."""
        return f"e-mail to {', '.join(self.described.to)} by {self.described.host}"

    def deliver(self, event: Event) -> None:
        """Send the mail; see `agent.night.telling.Sink`."""
        said = self.described
        message = mail_of(event, said)
        try:
            with smtplib.SMTP(said.host, said.port, timeout=said.timeout_s) as server:
                if said.starttls:
                    server.starttls(context=trust(said.ca_file, self.folder))
                if said.user:
                    server.login(said.user, self.password)
                refused = server.send_message(message)
        except smtplib.SMTPNotSupportedError as error:
            raise UndeliveredError(
                f"the server cannot do what it must: {error}", for_good=True
            ) from error
        except smtplib.SMTPAuthenticationError as error:
            raise UndeliveredError("user or password are not accepted", for_good=True) from error
        except smtplib.SMTPRecipientsRefused as error:
            raise UndeliveredError("every receiver was refused", for_good=True) from error
        except smtplib.SMTPResponseException as error:
            for_good = error.smtp_code >= 500
            raise UndeliveredError(
                f"the server answered {error.smtp_code}", for_good=for_good
            ) from error
        except ssl.SSLError as error:
            raise UndeliveredError(
                f"no encrypted line: {error.reason or error}", for_good=True
            ) from error
        except (OSError, smtplib.SMTPException) as error:
            raise UndeliveredError(f"{type(error).__name__}: {error}") from error
        if refused:
            raise UndeliveredError(f"refused for {', '.join(sorted(refused))}", for_good=True)


def mail_of(event: Event, said: Email) -> EmailMessage:
    """Return the mail: the sentence first, then what a technician may look up."""
    message = EmailMessage()
    message["Subject"] = subject(event)
    message["From"] = said.sender
    message["To"] = ", ".join(said.to)
    message["Date"] = format_datetime(MachineClock().now())
    message["Message-ID"] = make_msgid(domain=_domain(said.sender))
    message["Auto-Submitted"] = "auto-generated"
    lines = [event.text, "", f"when       {event.at}", f"robot      {event.robot}"]
    if event.axis is not None:
        lines.append(f"axis       {event.axis}")
    if event.recording:
        lines.append(f"recording  {event.details.get('file', '')} sha256 {event.recording}")
    lines += [f"{key:<10} {value}" for key, value in event.details.items() if key != "file"]
    message.set_content("\n".join(lines) + "\n")
    return message


def _domain(sender: str) -> str:
    try:
        return Address(addr_spec=sender).domain or "localhost"
    except (ValueError, IndexError):  # a display name is in front; not worth a failure
        return "localhost"
