"""Vocabulary of signal names: which words of the field mean what, in the databases and exports of
English, German, French, Italian and Spanish tools.
"""

import re
import unicodedata
from functools import cache

# Concept: its spellings. A word may belong to several concepts ("accel", "current").
CONCEPTS: dict[str, str] = {
    "engine": "engine eng crank crankshaft motor mot nmot ecm ecu moteur motore",
    "rpm": "rpm revs rev n nmot drehzahl rotational w omega angular revolutions ne regime giri tours rpms nmotor umdrehungen toerental",
    "speed": "speed spd speeds velocity vel v vss wspd geschwindigkeit geschw geschwind tempo kph mph vitesse velocita velocidad velocidade snelheid",
    "wheel": "wheel wheels whl ws wspd rad raeder tyre tire vwhl roue roues ruota ruote rueda ruedas roda wiel",
    "front": "front frnt f fr fl fw lf rf vorn vorne vorderrad vl vr v avant av anteriore ant delantera delantero dianteira voor",
    "rear": "rear rr rl rw lr back hinten hinterrad hl hr arriere ar posteriore trasera trasero traseira achter",
    "left": "left fl rl lf lr links li vl hl l gauche sinistra sx izquierda izq esquerda",
    "right": "right fr rr rf rechts re vr hr r droite destra dx derecha direita",
    "vehicle": "vehicle veh car vss fahrzeug fzg bike chassis vehicule veicolo vehiculo moto",
    "transmission": "transmission trans xmission gearbox getriebe turbine trn tcm",
    "other_shaft": "turbo fan pump compressor input output idle cam camshaft shaft prop driveshaft",
    "throttle": "throttle tb tps ths thr thrott plate drosselklappe dk etb etc butterfly papillon gaz farfalla mariposa",
    "position": "position pos posn opening tps apps pps stellung oeffnung percent pct pc aperture stelling posizione posicion ouverture apertura",
    "angle": "angle ang winkel",
    "pedal": "pedal pdl aped bped pps apps fahrpedal gaspedal gas pps accelerator accel fp accelerateur acceleratore acelerador",
    "grip": "grip twist twistgrip apps aps gas",
    "rider": "rider driver drv fahrer user",
    "button": "button btn taster knob pushbutton",
    "switch": "switch sw sws pressed schalter stat state active act actv on light lamp",
    "trial": "trial test launch bench pit start",
    "gear": "gear gears gang gr gearpos rapport marcia marcha versnelling",
    "clutch": "clutch clu cltch kupplung embrayage frizione embrague",
    "brake": "brake bped brk brakes braking brems bremse bremsen brakelight frein freins freno freni frenos",
    "pressure": "pressure press pres prs druck map boost p pression pressione presion pressao",
    "cylinder": "cylinder cyl master mc",
    "spark": "spark ignition ign timing zuendung zuendwinkel zw",
    "advance": "advance adv timing zuendwinkel winkel zw",
    "authority": "authority auth grant granted granting",
    "enable": "enable enabled enabling control ctrl",
    "mode": "mode modus",
    "request": "request req requested ask asked anforderung rq",
    "setpoint": "target set command demand setpoint cmd desired dsrd soll dmd tgt applied commanded echo",
    "offset": "offset trim correction delta corr korrektur",
    "current": "current curr amps strom i",
    "actual": "actual actl act ist meas measured current present",
    "fault": "fault error faulty fail failure err flt fehler malfunction defect",
    "coolant": "coolant clt ect water clnt kuehlmittel kuehlwasser cts wassertemperatur twater eau acqua agua refrigerante",
    "intake": "intake iat inlet mat ansaugluft charge airtemp admission aspirazione admision",
    "air": "air luft",
    "temperature": "temperature temp temps te clt ect iat mat temperatur twater airtemp tmp temperatura",
    "manifold": "manifold man map boost saugrohr mani ladedruck",
    "oil": "oil oel huile olio aceite",
    "fuel": "fuel kraftstoff carburant carburante combustible",
    "ambient": "ambient outside baro barometric atmospheric aussen",
    "steering": "steering steer lenkrad lenkwinkel lenk sas stw volant sterzo",
    "yaw": "yaw gier lacet imbardata",
    "pitch": "pitch nick tangage beccheggio",
    "lean": "lean roll bank leaning schraeglage roulis rollio piega inclinaison inclinacion",
    "rate": "rate gyro velocity vel gradient rate",
    "longitudinal": "longitudinal long lng ax x laengs longitudinale",
    "lateral": "lateral lat ay y quer laterale",
    "vertical": "vertical vert az z verticale",
    "acceleration": "acceleration accel acc accelerometer a ax ay az g beschl beschleunigung accelerazione aceleracion",
    "optical": "optical ground vbox correvit radar",
    "gnss": "gps gnss satellite sat",
    "suspension": "suspension susp fork shock damper damping federweg sospensione forcella horquilla fourche amortisseur",
    "travel": "travel stroke position pos displacement hub federweg pot",
    "teeth": "teeth tooth rotat pulses pulse edges",
    "count": "count cnt counter cntr counts zaehler",
    "protection": "crc checksum chksum chk cs alive livecounter seq sequence",
    "quality": "valid ok validity quality qf qual flag q inhibit stat status",
    "limit": "limit lim limiter min max minimum maximum limitation",
    "torque": "torque trq tq moment drehmoment tqe",
    "voltage": "voltage volt vbat battery batt u",
    "time": "time clock stamp timestamp tick duration zeit",
    "flow": "flow maf mass",
    "duty": "duty",
    "cruise": "cruise acc tempomat",
    "phase": "phase",
    "trip": "trip",
    "reason": "reason cause",
    "parking": "parking park ebrake hand handbrake",
    "course": "course heading bearing track cap rotta rumbo kurs",
    "latitude": "latitude lat breite breitengrad",
    "longitude": "longitude lon lng long laenge laengengrad",
    "altitude": "altitude alt elevation ele height hoehe quota altezza",
    "direction": "direction dir reverse",
    "lambda": "lambda lam afr",
    "compensated": "comp compensated corrected filtered filt",
    "average": "average avg mean averaged",
    "trailer": "trailer trlr",
    "diff": "difference diff",
}
NEUTRAL = {"actual", "compensated", "average", "rider"}
_NOISE = (
    "signal sig value val sensor sens raw abs absolute no id bus can msg message data info frame"
    " physical of the unit primary main in"
)
NOISE = frozenset(re.findall("[a-z]+", _NOISE))
_UMLAUTS = {"ä": "ae", "ö": "oe", "ü": "ue", "Ä": "Ae", "Ö": "Oe", "Ü": "Ue", "ß": "ss"}
LONG_ENOUGH = 3  # letters of a word that can be cut out of a run of letters


@cache
def _spellings() -> dict[str, frozenset[str]]:
    found: dict[str, set[str]] = {}
    for concept, words in CONCEPTS.items():
        for word in words.split():
            found.setdefault(word, set()).add(concept)
    return {word: frozenset(concepts) for word, concepts in found.items()}


@cache
def words_of(name: str) -> tuple[str, ...]:
    """Words of a signal's name, in lower case: "EngineSpd_RPM" -> engine, spd, rpm."""
    split = re.sub(r"([A-Z]+)([A-Z][a-z])", r"\1 \2", _plain(name))
    split = re.sub(r"([a-z0-9])([A-Z])", r"\1 \2", split)
    parts = (part.lower() for part in re.split(r"[^A-Za-z]+", split) if part)
    return tuple(word for part in parts for word in _cut(part))


def _plain(name: str) -> str:
    """Name in the letters A to Z: ö becomes oe, as in German, and é becomes e."""
    for letter, plain in _UMLAUTS.items():
        name = name.replace(letter, plain)
    return unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode()


@cache
def concepts_of(word: str) -> frozenset[str]:
    """Concepts that a word may stand for; none for a word that is not known."""
    known = _spellings()
    if word in known:
        return known[word]
    if word.endswith("s") and word[:-1] in known and len(word) > LONG_ENOUGH:
        return known[word[:-1]]
    for length in range(len(word) - 1, LONG_ENOUGH, -1):  # "temperat", "accelerat"
        if word[:length] in known and len(word) - length < LONG_ENOUGH:
            return known[word[:length]]
    longer = (
        [spelling for spelling in known if spelling.startswith(word)]
        if len(word) > LONG_ENOUGH
        else []
    )
    return known[min(longer, key=len)] if longer else frozenset()


@cache
def concepts_in(name: str) -> frozenset[str]:
    """Concepts of all words of a name."""
    return frozenset(concept for word in words_of(name) for concept in concepts_of(word))


def is_noise(word: str) -> bool:
    """Whether a word does not help to identify a signal."""
    return word in NOISE or len(word) == 1


@cache
def _cut(part: str) -> tuple[str, ...]:
    """Known words of a run of letters, "wheelspeedfl" -> wheel, speed, fl; else the run itself."""
    if part in NOISE or concepts_of(part):
        return (part,)
    return _pieces(part) or (part,)


def _pieces(run: str) -> tuple[str, ...]:
    if not run:
        return ()
    known = _spellings()
    for length in range(len(run), 1, -1):
        head, tail = run[:length], run[length:]
        if head not in known and head not in NOISE:
            continue
        if not tail:
            return (head,)
        if length >= LONG_ENOUGH and (remainder := _pieces(tail)):
            return head, *remainder
    return ()
