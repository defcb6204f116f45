"""The bus in the description of an FMU: variables, terminal and manifest of FMI-LS-BUS 1.0.

Source: Modelica Association, FMI Layered Standard for Network Communication (FMI-LS-BUS), version 1.0,
network abstraction.
"""

from xml.etree import ElementTree as Xml

from slipbench.plant.fmu.bus import Bus

TERMINALS = "terminalsAndIcons/terminalsAndIcons.xml"
MANIFEST = "extra/org.fmi-standard.fmi-ls-bus/fmi-ls-manifest.xml"
"""Places in the FMU."""
MIME = 'application/org.fmi-standard.fmi-ls-bus.can; version="1.0.0"'
MEMBERS = ("Rx_Data", "Tx_Data", "Rx_Clock", "Tx_Clock")
NOTIFICATIONS = "BusNotifications"
LAYERED = "http://fmi-standard.org/fmi-ls-manifest"


def add_bus(listed: Xml.Element, bus: Bus, step: float, first: int) -> None:
    """Add the variables of the terminal. step: internal step, s; first: value reference."""
    rx_data, tx_data, rx_clock, tx_clock, notifications = map(str, range(first, first + 5))
    binary = {"variability": "discrete", "maxSize": str(bus.buffer), "mimeType": MIME}
    received = {"valueReference": rx_data, "causality": "input", "clocks": rx_clock, **binary}
    entry = Xml.SubElement(listed, "Binary", {"name": f"{bus.name}.Rx_Data", **received})
    Xml.SubElement(entry, "Start", {"value": ""})
    sent = {"valueReference": tx_data, "causality": "output", "clocks": tx_clock, **binary}
    Xml.SubElement(listed, "Binary", {"name": f"{bus.name}.Tx_Data", **sent})
    triggered = {"causality": "input", "intervalVariability": "triggered"}
    named = {"name": f"{bus.name}.Rx_Clock", "valueReference": rx_clock}
    Xml.SubElement(listed, "Clock", {**named, **triggered})
    interval = repr(round(bus.interval(step) * step, 12))
    periodic = {"intervalVariability": "constant", "intervalDecimal": interval}
    named = {"name": f"{bus.name}.Tx_Clock", "valueReference": tx_clock, "causality": "input"}
    Xml.SubElement(listed, "Clock", {**named, **periodic})
    named = {"name": f"{bus.name}.{NOTIFICATIONS}", "valueReference": notifications}
    fixed = {"causality": "parameter", "variability": "fixed", "start": "false"}
    Xml.SubElement(listed, "Boolean", {**named, **fixed})


def add_bus_output(structure: Xml.Element, first: int) -> None:
    """Add the output to the structure. first: value reference of the terminal's variables."""
    output = Xml.Element("Output", {"valueReference": str(first + 1)})
    outputs = len(structure.findall("Output"))
    structure.insert(outputs, output)


def terminals(bus: Bus) -> str:
    """Return the text of terminalsAndIcons.xml."""
    root = Xml.Element("fmiTerminalsAndIcons", {"fmiVersion": "3.0"})
    terminal = Xml.SubElement(
        Xml.SubElement(root, "Terminals"),
        "Terminal",
        {
            "name": bus.name,
            "terminalKind": "org.fmi-ls-bus.network-terminal",
            "matchingRule": "org.fmi-ls-bus.transceiver",
            "description": "CAN",
        },
    )
    for member in MEMBERS:
        _add_member(terminal, bus.name, member)
    kind = "org.fmi-ls-bus.network-terminal.configuration"
    settings = {"name": "Configuration", "terminalKind": kind, "matchingRule": "bus"}
    _add_member(Xml.SubElement(terminal, "Terminal", settings), bus.name, NOTIFICATIONS)
    Xml.indent(root)
    return Xml.tostring(root, encoding="unicode", xml_declaration=True)


def _add_member(terminal: Xml.Element, bus: str, member: str) -> None:
    Xml.SubElement(
        terminal,
        "TerminalMemberVariable",
        {"variableKind": "signal", "variableName": f"{bus}.{member}", "memberName": member},
    )


def manifest() -> str:
    """Return the text of fmi-ls-manifest.xml."""
    Xml.register_namespace("fmi-ls", LAYERED)
    root = Xml.Element(
        "fmiLayeredStandardManifest",
        {
            f"{{{LAYERED}}}fmi-ls-name": "org.fmi-standard.fmi-ls-bus",
            f"{{{LAYERED}}}fmi-ls-version": "1.0.0",
            f"{{{LAYERED}}}fmi-ls-description": "CAN by network abstraction",
            "isBusSimulationFMU": "false",
        },
    )
    return Xml.tostring(root, encoding="unicode", xml_declaration=True)
