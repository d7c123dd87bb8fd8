"""The page's and the metrics' sections of a rig file: addresses, tokens, and that a token stays at home."""

from dataclasses import replace
from pathlib import Path

import pytest
import yaml

from gateway.profiles import ProfileError, load_rig, shipped_profiles_folder
from gateway.profiles.http_sections import split_listen, without_secrets
from gateway.profiles.rigs.assembly import check_report

TOKEN = "6f1c6a51d9b04c0e"


def rig_with(tmp_path: Path, section: str) -> str:
    file = tmp_path / "rig.yaml"
    file.write_text(
        (shipped_profiles_folder() / "rigs" / "demo.yaml").read_text(encoding="utf-8") + section, encoding="utf-8"
    )
    return str(file)


@pytest.mark.parametrize(
    ("text", "split"),
    [
        ("127.0.0.1:8080", ("127.0.0.1", 8080)),
        ("localhost:0", ("127.0.0.1", 0)),
        ("[::1]:8080", ("::1", 8080)),
        ("192.168.125.20:65535", ("192.168.125.20", 65535)),
    ],
)
def test_an_address_is_a_host_and_a_port(text: str, split: tuple[str, int]) -> None:
    assert split_listen(text) == split


@pytest.mark.parametrize(
    "text", ["127.0.0.1", "8080", "::1:8080", "host.example:8080", "127.0.0.1:65536", "127.0.0.1:-1", ""]
)
def test_anything_else_is_refused_in_the_file(tmp_path: Path, text: str) -> None:
    with pytest.raises(ProfileError, match=r"web\.listen"):
        load_rig(rig_with(tmp_path, f'web: {{listen: "{text}"}}\n'))


@pytest.mark.parametrize("text", ["8080", '"8080"', '":8080"'])
def test_what_is_proposed_for_a_port_alone_is_taken(tmp_path: Path, text: str) -> None:
    """It was "write it in quotes", and then no address."""
    with pytest.raises(ProfileError, match=r"web\.listen: :?8080 is a port alone: write 127\.0\.0\.1:8080") as told:
        load_rig(rig_with(tmp_path, f"web: {{listen: {text}}}\n"))
    cure = str(told.value).rpartition("write ")[2]
    rig = load_rig(rig_with(tmp_path, f"web: {{listen: {cure}}}\n"))
    assert rig.web and rig.web.listen == "127.0.0.1:8080"


def test_opc_ua_has_a_port_that_a_client_can_know(tmp_path: Path) -> None:
    """With any free one it would be another after each start, and nothing says which."""
    with pytest.raises(ProfileError, match=r"opcua\.listen"):
        load_rig(rig_with(tmp_path, 'opcua: {listen: "127.0.0.1:0"}\n'))
    rig = load_rig(rig_with(tmp_path, 'opcua: {listen: "127.0.0.1:4841"}\n'))
    assert rig.opcua and rig.opcua.listen == "127.0.0.1:4841"


def test_a_page_for_others_needs_a_token_that_cannot_be_guessed(tmp_path: Path) -> None:
    with pytest.raises(ProfileError, match=r"web\.listen: E128 0\.0\.0\.0:8080 can be reached from other machines"):
        load_rig(rig_with(tmp_path, 'web: {listen: "0.0.0.0:8080"}\n'))
    with pytest.raises(ProfileError, match=r"web\.token"):
        load_rig(rig_with(tmp_path, 'web: {listen: "0.0.0.0:8080", token: short}\n'))
    rig = load_rig(
        rig_with(tmp_path, f'web: {{listen: "0.0.0.0:8080", token: {TOKEN}}}\nmetrics: {{listen: "[::1]:0"}}\n')
    )
    assert rig.web and rig.web.token == TOKEN
    assert rig.metrics and rig.metrics.listen == "[::1]:0"


@pytest.mark.parametrize("key", ["token", '"to\\u006ben"', '"\\x74oken"'])
def test_a_token_does_not_travel_with_the_rig_s_texts(key: str, tmp_path: Path) -> None:
    """Every recording carries them, a bundle too, and the page shows them."""
    rig = load_rig(rig_with(tmp_path, f'web: {{listen: "0.0.0.0:8080", {key}: "{TOKEN}"}}\n'))
    assert rig.web and rig.web.token == TOKEN and all(TOKEN not in text for text in rig.texts.values())
    copy = tmp_path / "copy.yaml"
    copy.write_text(next(text for name, text in rig.texts.items() if name.endswith("rig.yaml")), encoding="utf-8")
    assert load_rig(str(copy)).web is not None, "what is left can be read as before"
    assert without_secrets(f"password: '{TOKEN}' # of the broker") == "password: removed-from-this-copy # of the broker"
    assert without_secrets(f"brokers:\n- host: a\n- password: {TOKEN}\n").endswith(
        "- password: removed-from-this-copy\n"
    )


def test_a_key_that_goes_on_in_the_next_line_hides_no_token() -> None:
    for end in ("\n", "\r\n", "\r", "\x85", "\u2028"):
        text = f'? "pass\\{end}  word"\n: {TOKEN}\n'
        assert TOKEN in str(yaml.safe_load(text)["password"])
        assert TOKEN not in without_secrets(text)


def test_a_device_s_line_ends_are_not_taken_for_the_spelling_of_a_token(monkeypatch) -> None:
    """Its file was read once more for them at each start, by the slower of both readers: as long as all the rest took."""
    monkeypatch.setattr(yaml, "compose", lambda *_: pytest.fail("it is read once more"))
    text = 'terminator: "\\r\\n"\nask: "SET {value:int}"\n'
    assert without_secrets(text) == text


@pytest.mark.parametrize(
    "section",
    [
        "web:\n  token: quokka horse battery staple # of the page\n  listen: 0.0.0.0:8080\n",
        "web:\n  token: quokka,horse,battery,staple\n  listen: 0.0.0.0:8080\n",
        "web:\n  token: quokka#horse}battery#staple\n  listen: 0.0.0.0:8080\n",
        'web: {token: "quokka \\"horse\\" battery staple", listen: "0.0.0.0:8080"}\n',
        "web: {token: quokka horse battery staple, listen: '0.0.0.0:8080'}\n",
        "web: {\n  token: quokka horse battery staple,\n  listen: '0.0.0.0:8080'\n}\n",
        "web:\n  token: quokka horse\n    battery staple\n  listen: 0.0.0.0:8080\n",
        "web:\n  token: >-\n    quokka horse\n    battery staple\n  listen: 0.0.0.0:8080\n",
    ],
)
def test_no_part_of_a_token_travels_however_it_is_written(tmp_path: Path, section: str) -> None:
    """Of one with a space, a comma or a number sign in it, all but its first word stood in each recording."""
    rig = load_rig(rig_with(tmp_path, section))
    assert rig.web and rig.web.token and "horse" in rig.web.token
    text = next(text for name, text in rig.texts.items() if name.endswith("rig.yaml"))
    assert not any(word in text for word in ("quokka", "horse", "battery", "staple"))
    copy = tmp_path / "copy.yaml"
    copy.write_text(text, encoding="utf-8")
    again = load_rig(str(copy))
    assert again.web == replace(rig.web, token="removed-from-this-copy") and again.control == rig.control


def test_a_token_that_is_not_there_is_none_in_the_copy(tmp_path: Path) -> None:
    rig = load_rig(rig_with(tmp_path, "web: {token: null}\n"))
    assert "token: null" in next(text for name, text in rig.texts.items() if name.endswith("rig.yaml"))


@pytest.mark.parametrize(
    ("section", "told"),
    [
        ("web: {token: quokka horse}\n", "web.token: what stands there is shorter than 16 characters"),
        (f"web: {{token: {'quokka ' * 30}}}\n", "web.token: what stands there is longer than 200 characters"),
        ("web: {token: 77001133557799001122}\n", "web.token: what stands there is not text: write it in quotes"),
        (
            "mqtt: {host: broker, password_file: quokka}\n",
            "mqtt.password_file: what stands there does not have the form",
        ),
    ],
)
def test_a_fault_of_a_secret_does_not_quote_it(tmp_path: Path, section: str, told: str) -> None:
    """Faults stand in the journal, in the events of a start that they end, and so in a bundle for support."""
    with pytest.raises(ProfileError) as raised:
        load_rig(rig_with(tmp_path, section))
    assert told in str(raised.value)
    assert "quokka" not in str(raised.value) and "7700" not in str(raised.value)


def test_a_key_of_mqtt_without_its_certificate_is_a_fault(tmp_path: Path) -> None:
    """It was passed over: the broker that asks for a certificate was shown none."""
    with pytest.raises(ProfileError, match=r"mqtt\.tls: key without certificate"):
        load_rig(rig_with(tmp_path, "mqtt: {host: broker, tls: {ca: /ca.pem, key: /key.pem}}\n"))
    whole = load_rig(rig_with(tmp_path, "mqtt: {host: broker, tls: {ca: /ca.pem, certificate: /both.pem}}\n"))
    assert whole.mqtt and whole.mqtt.tls and whole.mqtt.tls.key is None


@pytest.mark.parametrize(
    ("text", "copy"),
    [
        ("a: 1\n# token: quokka horse # of before\nb: 2\n", "a: 1\n# token: removed-from-this-copy\nb: 2\n"),
        (
            "web:\n  token: new-one # not token = quokka\n",
            "web:\n  token: removed-from-this-copy # not token = removed-from-this-copy\n",
        ),
        (
            'a: "it is # token: no comment" # a token, password: quokka',
            'a: "it is # token: no comment" # a token, password: removed-from-this-copy',
        ),
        ("a: it#token:x\n#password:quokka", "a: it#token:x\n#password:removed-from-this-copy"),
        ("# Token: quokka\na: 1\n", "# Token: removed-from-this-copy\na: 1\n"),
        (
            "# quokka-horse is our token\nweb: {token: quokka-horse} # as in the panel: quokka-horse\n",
            "#removed-from-this-copy\nweb: {token: removed-from-this-copy} #removed-from-this-copy\n",
        ),
        ("a: |\n  # token: of a text\nb: 1 # token\n", "a: |\n  # token: of a text\nb: 1 # token\n"),
    ],
)
def test_a_token_in_a_comment_does_not_travel_either_and_what_is_no_comment_stays(text: str, copy: str) -> None:
    """The token of before is kept there, in case the new one fails."""
    assert without_secrets(text) == copy


@pytest.mark.parametrize(
    ("mqtt", "place", "sentence"),
    [
        (
            "password_file: {folder}/gone",
            "mqtt.password_file",
            "{folder}/gone: No such file or directory; name the right",
        ),
        ("tls: {{ca: {folder}/gone}}", "mqtt.tls.ca", "{folder}/gone: No such file or directory"),
        ("tls: {{ca: {folder}/text}}", "mqtt.tls.ca", "{folder}/text holds no certificate in PEM form"),
        ("tls: {{ca: {folder}/ca, certificate: {folder}}}", "mqtt.tls.certificate", "{folder}: it is a directory"),
        (
            "tls: {{ca: {folder}/ca, certificate: {folder}/ca, key: {folder}/ca}}",
            "mqtt.tls.key",
            "{folder}/ca holds no private key in PEM form",
        ),
        (
            "tls: {{ca: {folder}/ca, certificate: {folder}/ca, key: {folder}/locked}}",
            "mqtt.tls.key",
            "{folder}/locked has a password: openssl pkey -in {folder}/locked",
        ),
    ],
)
def test_a_file_of_the_broker_that_is_not_there_or_no_such_file_is_told_by_check(
    mqtt: str, place: str, sentence: str, tmp_path: Path
) -> None:
    """It was told at run only. No fault: everything but MQTT works without it."""
    (tmp_path / "text").write_text("secret\n")
    (tmp_path / "ca").write_text("-----BEGIN CERTIFICATE-----\n")
    (tmp_path / "locked").write_text("-----BEGIN ENCRYPTED PRIVATE KEY-----\n")
    report = check_report(rig_with(tmp_path, f"mqtt: {{host: broker, {mqtt.format(folder=tmp_path)}}}\n"))
    assert not report.faults
    (warning,) = [one for one in report.warnings if one.path.startswith("mqtt")]
    assert f"{place}: E181 {sentence.format(folder=tmp_path)}" in str(warning)
    assert str(warning).endswith("until then there is no MQTT")


def test_files_of_the_broker_that_are_there_are_no_matter(tmp_path: Path) -> None:
    (tmp_path / "secret").write_text("secret\n")
    (tmp_path / "both").write_text("-----BEGIN CERTIFICATE-----\n-----BEGIN PRIVATE KEY-----\n")
    named = f"password_file: {tmp_path}/secret, tls: {{ca: {tmp_path}/both, certificate: {tmp_path}/both}}"
    report = check_report(rig_with(tmp_path, f"mqtt: {{host: broker, {named}}}\n"))
    assert not report.faults and not [one for one in report.warnings if one.path.startswith("mqtt")]
