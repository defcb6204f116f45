"""A proposed binding as a TOML file with comments, which the user confirms by editing it."""

from collections.abc import Iterator

from slipbench.protocol.binding.capture import Traffic, describe
from slipbench.protocol.binding.fields import FIELDS
from slipbench.protocol.binding.match import ALIKE, REQUESTS, Match
from slipbench.protocol.binding.missing import Need, needs
from slipbench.protocol.binding.propose import Chosen, Proposal
from slipbench.protocol.binding.source_lines import lacks_unit, stated
from slipbench.protocol.binding.words import concepts_in
from slipbench.protocol.database.layout import Checksum, Message, Protection
from slipbench.protocol.errors import readable
from slipbench.protocol.recording.message_rules import Degraded

WIDTH = 96
LONGEST = 2000  # characters of a comment
SAME_CYCLE = 0.2  # relative difference up to which a measured cycle time is the stated one


def binding_text(proposal: Proposal, title: str, database: str) -> str:
    """Text of the binding file. database: path of the database, relative to that file."""
    return "\n".join(
        [
            *_head(proposal, title, database),
            *_degraded(proposal),
            *_messages(proposal),
            *_roles(proposal),
            *_not_found(proposal),
            "",
        ]
    )


def _head(proposal: Proposal, title: str, database: str) -> Iterator[str]:
    measured = (
        f"and from the capture {proposal.capture.origin}" if proposal.capture else "(no capture)"
    )
    yield f"# Proposed by slipbench bind from {database} {measured}."
    yield "# Every entry is a proposal: confirm it, or replace it by another signal of its list."
    yield "# Then run slipbench check on the bus. Scores are 0 to 1; they are no probabilities."
    yield f"title = {quoted(title)}"
    yield f"database = {quoted(database)}"


def _degraded(proposal: Proposal) -> Iterator[str]:
    """What the bus lacks. What only the user can state stays a comment."""
    bound = set(proposal.bound)
    yield ""
    yield "[degraded]"
    wheels = {"rear_wheel_speed", "front_wheel_speed"} <= bound and len(proposal.teeth) < 2
    if wheels:
        yield 'wheels = "wheel_speed" # no message of tooth times was found'
    if "optical_speed" not in bound:
        speed = "gnss" if "gnss_speed" in bound else "front_wheel"
        yield f'speed = "{speed}" # no optical speed was found'
    chosen = Degraded(
        wheels="wheel_speed" if wheels else None,
        speed=None
        if "optical_speed" in bound
        else "gnss"
        if "gnss_speed" in bound
        else "front_wheel",
    )
    open_ = [each for each in needs(chosen, bound, spark=False) if _missing(each, bound, proposal)]
    if open_:
        yield "# A trial lacks these roles. Bind them below, or accept their absence here: each line"
        yield "# is your statement about this motorcycle, so slipbench does not make it for you."
    unmonitored = [each for each in open_ if each.instead.startswith("unmonitored")]
    for need in open_:
        if need not in unmonitored:
            yield f"# {need.role}: without it {need.without}"
            if need.instead:
                yield f"#   {need.instead}"
    if unmonitored:
        names = ", ".join(f'"{each.role}"' for each in unmonitored)
        for need in unmonitored:
            yield f"# {need.role}: without it {need.without}"
        yield f"#   unmonitored = [{names}]"


def _missing(need: Need, bound: set[str], proposal: Proposal) -> bool:
    if need.role.endswith("_teeth"):
        return need.role.removesuffix("_teeth") not in {each.wheel for each in proposal.teeth}
    return need.role not in bound


def _messages(proposal: Proposal) -> Iterator[str]:
    for message in proposal.carriers():
        traffic = proposal.traffic(message.name)
        if traffic is None:
            yield from _unseen(proposal, message)
            continue
        lines = [*_cycle(message, traffic), *_protection(message, traffic)]
        if lines:
            yield ""
            if all(line.startswith("#") for line in lines):
                yield f"# Message {message.name}:"
            else:
                yield f"[messages.{message.name}]"
            yield from lines


def _unseen(proposal: Proposal, message: Message) -> Iterator[str]:
    """A message that is not in the capture: of a request only the user knows the protection."""
    sent = any(
        proposal.bound[role].message == message for role in REQUESTS if role in proposal.bound
    )
    named = [
        signal.name
        for signal in message.signals
        if not concepts_in(signal.name).isdisjoint(("count", "protection"))
    ]
    if sent and message.protection is None:
        looks = f" ({', '.join(named)} may belong to one)" if named else ""
        yield ""
        yield from wrapped(
            f"The bench sends {message.name}. State the protection that the ECU expects of it{looks},"
            " and its cycle time:"
        )
        yield f"# [messages.{message.name}]"
        yield '# protection = { profile = "E2E1", data_id = 0x0000 }'


def _cycle(message: Message, traffic: Traffic) -> Iterator[str]:
    measured, stated = traffic.cycle_time, message.cycle_time
    if measured is None:
        yield f"# not cyclic in the capture: {traffic.frames} frames, the longest gap {_ms(traffic.longest)}"
        return
    same = stated is not None and abs(measured - stated) <= SAME_CYCLE * stated
    if same:
        return
    beside = f"; the database states {_ms(stated)}" if stated else ""
    found = f"measured: {traffic.frames} frames, the longest gap {_ms(traffic.longest)}{beside}"
    yield f'cycle_time = "{_ms(measured)}" # {found}'


def protection_text(message: Message, traffic: Traffic) -> str:
    """Entry `protection` of a message as identified from the capture; "" where none is."""
    lines = [line for line in _protection(message, traffic) if not line.startswith("#")]
    return lines[0].partition(" #")[0] if lines else ""


def _protection(message: Message, traffic: Traffic) -> Iterator[str]:
    for note in traffic.notes:
        yield f"# {note}"
    if traffic.profile is not None:
        yield from _profile(message, traffic.profile.protection, traffic)
        return
    if message.protection is not None:
        if not traffic.contradicted:
            return
        yield "# The capture contradicts the protection that the database states."
    if traffic.others:
        names = ", ".join(describe(each) for each in traffic.others)
        yield f"# checksum: {describe(_rule(traffic))} in {_rule(traffic).signal}, but {names}"
        yield "#   explains the frames as well; a capture in which more signals change decides"
    parts = []
    if traffic.counter:
        parts.append(f"counter = {quoted(traffic.counter)}, period = {traffic.period}")
    if traffic.checksum is not None and not traffic.others:
        parts.append(f"checksum = {_checksum(traffic.checksum)}")
    if parts:
        found = f"holds in {traffic.share:.1%} of {traffic.frames} frames"
        yield f'protection = {{ profile = "plain", {", ".join(parts)} }} # {found}'


def _rule(traffic: Traffic) -> Checksum:
    assert traffic.checksum is not None
    return traffic.checksum


def _profile(message: Message, found: Protection, traffic: Traffic) -> Iterator[str]:
    assert traffic.profile is not None
    if not traffic.contradicted and message.protection is not None:
        return
    share = f"holds in {traffic.profile.share:.1%} of {traffic.frames} frames"
    if found.profile == 2:
        ids = ", ".join(map(str, found.data_ids))
        yield f'protection = {{ profile = "E2E2", data_ids = [{ids}] }} # {share}'
        return
    same = traffic.profile.equivalent
    beside = f"; {same} data ids give the same CRC, this is the least" if same > 1 else ""
    yield (
        f'protection = {{ profile = "E2E{found.profile}", data_id = 0x{found.data_id:04X} }}'
        f" # {share}{beside}"
    )


def _checksum(rule: Checksum) -> str:
    text = f"{{ signal = {quoted(rule.signal)}, kind = {quoted(rule.kind)}"
    if rule.kind == "crc8":
        text += f", polynomial = 0x{rule.polynomial:02X}"
    if rule.start:
        text += f", start = 0x{rule.start:02X}"
    if rule.final_xor:
        text += f", final_xor = 0x{rule.final_xor:02X}"
    return text + " }"


def _roles(proposal: Proposal) -> Iterator[str]:
    for each in proposal.teeth:
        yield ""
        yield f"[roles.{each.wheel}_teeth] # by the layout of the message"
        yield f"teeth = {quoted(each.teeth)}"
        yield f"anchor = {quoted(each.anchor)}"
        yield f'clock = "{each.wheel}_encoder"'
        for key, names in (("names", each.names), ("anchor_names", each.anchor_names)):
            if names:
                pairs = ", ".join(f"{own} = {quoted(name)}" for own, name in names.items())
                yield f"{key} = {{ {pairs} }}"
    for chosen in proposal.roles:
        if chosen.best is not None:
            yield from _role(proposal, chosen, chosen.best)


def _role(proposal: Proposal, chosen: Chosen, best: Match) -> Iterator[str]:
    yield ""
    close = "; CHECK: others are close" if chosen.is_close else ""
    yield from wrapped(f"{best.score:.2f}: {', '.join(best.reasons)}{close}")
    others = [each for each in chosen.others if each.score >= ALIKE]
    if others:
        yield from wrapped("others: " + ", ".join(_named(each) for each in others))
    mark = "" if not lacks_unit(chosen.role, best) else "# "
    if mark:
        yield "# Not bound yet: state the unit, then remove the number signs."
    yield f"{mark}[roles.{chosen.role}]"
    yield f"{mark}signals = [{quoted(best.name)}]"
    for line in stated(proposal, chosen.role, best):
        check = f" # CHECK: {line.check}" if line.check else ""
        yield f"{mark}{line.key} = {line.value}{check}"


def _not_found(proposal: Proposal) -> Iterator[str]:
    lost = [each for each in proposal.roles if each.best is None and each.role in FIELDS]
    if not lost:
        return
    yield ""
    yield "# Roles of the bench that were not found, with the nearest signals:"
    for each in lost:
        near = (
            ", ".join(_named(other) for other in each.others if other.score >= ALIKE)
            or "none that is alike"
        )
        yield from wrapped(f"{each.role}: {near}")


def _named(found: Match) -> str:
    return f"{found.name} [{found.signal.unit or '-'}] {found.score:.2f}"


def wrapped(text: str) -> Iterator[str]:
    """A comment of lines that are not too long; control characters are escaped."""
    line = "#"
    for word in readable(text, LONGEST).replace("\n", " ").split(" "):
        if len(line) + len(word) + 1 > WIDTH:
            yield line
            line = "#  "
        line += f" {word}"
    yield line


def _ms(time: float | None) -> str:
    return f"{(time or 0.0) * 1e3:.4g} ms"


def quoted(text: str) -> str:
    """A basic string of TOML."""
    escaped = "".join(
        f"\\u{ord(c):04X}" if ord(c) < 0x20 or ord(c) == 0x7F else c
        for c in text.replace("\\", "\\\\").replace('"', '\\"')
    )
    return f'"{escaped}"'
