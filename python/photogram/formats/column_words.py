"""Column headings of coordinates, and words for control and check points.

All readers of points with coordinates use this table. Words are without accents and marks (`hohe` is Höhe). A
heading is known if it is one of the words, or if all its words have one meaning (`X/Easting`, `Punkt-Nr.`).
"""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Collection, Mapping

PHOTO_WORDS = frozenset(
    {"photo", "image", "image name", "imagename", "filename", "file name", "file", "picture"}
)
"""Headings of the column of photos."""
PIXEL_WORDS: Mapping[str, str] = {
    **dict.fromkeys(("x", "u", "col"), "column"),
    **dict.fromkeys(("y", "v"), "row"),
}
"""Headings of image coordinates, in columns and rows."""
ROLE = "use"  # Column of the roles: control or check
_COLUMNS: Mapping[str, Mapping[str, str]] = {
    "point": {
        "en": "point, points, name, id, pid, number, no, nr, p, pt, pnt, label, marker, target,"
        " station, mark, ident, track",
        "de": "punkt, punktnummer, punktname, punktnr, pktnr, ptnr, pkt, nummer, bezeichnung, kennung",
        "fr": "nom, numero, num, matricule, repere, cible",
        "es/it/pt": "punto, nombre, nome, ponto, codigo",
        "nl": "punt, puntnummer, naam",
    },
    "x": {
        "en": "x, e, easting, eastings, east, xcoord",
        "de": "rechtswert, rechts, rw, ostwert, ost",
        "fr": "est, abscisse",
        "es/it/pt": "este, leste",
        "nl": "oost",
    },
    "y": {
        "en": "y, n, northing, northings, north, ycoord",
        "de": "hochwert, hoch, hw, nordwert",
        "de/fr/it": "nord, ordonnee",
        "es/pt": "norte",
        "nl": "noord",
    },
    "z": {
        "en": "z, h, height, elevation, elev, altitude, alt, level, rl, zcoord",
        "de": "hohe, hoehe",
        "fr": "hauteur, cote",
        "es/it/pt": "cota, quota, altura, altitud, altezza, elevacion, elevacao",
        "nl": "hoogte",
    },
    "longitude": {
        "en": "longitude, lon, long, lng",
        "de": "lange, laenge, langengrad, laengengrad",
        "es/it/nl": "longitud, longitudine, lengte",
    },
    "latitude": {
        "en": "latitude, lat",
        "de": "breite, breitengrad",
        "es/it/nl": "latitud, latitudine, breedte",
    },
    "sd": {
        "en": "sd, s, sigma, std, stddev, stdev, dev, accuracy, acc, precision, uncertainty, rms, rmse, se",
        "en/de": "deviation, standard deviation, std dev, standardabweichung, stdabw, streuung, genauigkeit",
        "fr": "ecart type, ecart, incertitude",
        "es/it/pt": "exactitud, desviacion, precisione, precisao, desvio, incertidumbre",
        "nl": "nauwkeurigkeit",
    },
    ROLE: {
        "en": "use, usage, used, type, role, kind, category, status, class",
        "de": "art, typ, punktart, verwendung, funktion, rolle",
        "fr": "nature, utilisation",
        "es/it/pt": "tipo, uso, clase, classe, ruolo, papel",
        "nl": "soort, gebruik",
    },
    "check": {"en": "check, checkpoint, check point, is check", "de": "kontrollpunkt, prufpunkt"},
    "enabled": {"en": "enable, enabled"},
    "": {
        # Columns that an adjustment does not need, even if they contain numbers.
        "en": "code, description, desc, comment, comments, remark, remarks, note, notes, d, feature, order,"
        " group, date, time, epoch, age, fix, satellites, sats, pdop, hdop, vdop, gdop, antenna,"
        " antenna height, instrument, operator, photo, image, images, projections, zone, crs, epsg,"
        " system, datum, unit",
        "de": "bemerkung, bemerkungen, beschreibung, kommentar, datum, uhrzeit, zeit, zone, ordnung",
        "fr": "description, remarque, remarques, commentaire, heure, fuseau",
        "agisoft": "x est, y est, z est, error, x error, y error, z error, error pix, longitude est,"
        " latitude est, altitude est, x error m, y error m, z error m",
    },
}
_ROLES: Mapping[str, Mapping[str, str]] = {
    "control": {
        "en": "control, gcp, gcps, control point, ground control, ground control point, held, 3dgcp, full",
        "de": "passpunkt, pp, pass, festpunkt",
        "fr": "appui, point d appui, pa, calage",
        "es/it/pt": "apoyo, punto de apoyo, appoggio, apoio",
        "nl": "paspunt",
    },
    "check": {
        "en": "check, chk, checkpoint, check point, ccp, icp, qc, validation, verification, independent",
        "de": "kp, kontroll, kontrollpunkt, prufpunkt, pruefpunkt, pruf, vergleichspunkt",
        "fr": "point de verification",
        "es/it/pt": "chequeo, verificacion, comprobacion, verifica, verificacao, checagem",
        "nl": "controlepunt",
    },
    "off": {
        "en": "off, unused, ignore, disabled, none, not used, excluded",
        "de": "aus, gesperrt",
        "fr": "ignore",
    },
    # Control or check, depending on the program; the other role has another word.
    "?": {"en": "cp", "fr": "controle, point de controle, pc", "es/pt/it": "controllo, punto de control"},
}
_METRES: Mapping[float, str] = {
    1.0: "m, meter, metre, meters, metres",
    1000.0: "km",
    0.01: "cm",
    0.001: "mm",
    0.3048: "ft, feet, foot, ift",
    1e-6: "um, μm, micron, microns, micrometer, micrometre",
    1200 / 3937: "us-ft, usft, ftus, sft, us survey ft, us survey feet",
}
_RADIANS: Mapping[float, str] = {
    1.0: "rad",
    1e-3: "mrad",
    math.pi / 180: "deg, degree, degrees, °",
    math.pi / 10_800: "arcmin",
    math.pi / 648_000: "arcsec",
    math.pi / 200: "gon, grad, grads",
    math.pi / 200_000: "mgon",
}
UNITS: Mapping[str, float] = {word: size for size, words in _METRES.items() for word in words.split(", ")}
"""Units of length in headings, in metres."""
KINDS_OF_UNITS: Mapping[str, Mapping[str, float]] = {
    "length": UNITS,
    "angle": {word: size for size, words in _RADIANS.items() for word in words.split(", ")},
    "pixel": dict.fromkeys(("px", "pixel", "pixels"), 1.0),
    "time": {"s": 1.0, "sec": 1.0, "ms": 1e-3},
}
"""Units in headings: metres, radians, pixels, seconds."""
ANGULAR: Mapping[str, str] = {"longitude": "x", "latitude": "y"}
_SMALL = (
    "coordinate coordinates coord koordinate coordonnee the of de du la des in value wert point"
    " utm gk wgs84 etrs89 etrs gauss kruger krueger lokal local map grid ellipsoidal ellipsoid ellips"
    " ellipsoidische nn nhn nap orthometric geographic geographische geogr u uber ueber"
    " msl above over sea gcp decimal"
    " deg degrees dd"
)
_FILLERS = frozenset(_SMALL.split())
_BRACKETS = re.compile(r"[(\[{]([^)\]}]*)[)\]}]")
_COVERAGE = re.compile(r"\bk\s*=\s*(\d+(?:[.,]\d*)?)")
_EXPANDED = re.compile(r"u(xyz|xy|[xyzenh])?")
"""U, the expanded uncertainty; the heading contains the coverage factor."""


def _looked_up(table: Mapping[str, Mapping[str, str]]) -> dict[str, str]:
    found = dict[str, str]()
    for meaning, languages in table.items():
        for words in languages.values():
            for word in words.split(","):
                found.setdefault(" ".join(word.split()), meaning)
    return found


_KNOWN, _KNOWN_ROLES = _looked_up(_COLUMNS), _looked_up(_ROLES)


def words_of(text: str) -> list[str]:
    """Return the words of a heading in small letters, without accents."""
    bare = unicodedata.normalize("NFKD", _BRACKETS.sub(" ", text).casefold().replace("σ", " sigma "))
    plain = "".join(each for each in bare if not unicodedata.combining(each))
    return re.sub(r"[^0-9a-z]+", " ", plain).split()


def _meaning(words: list[str]) -> str | None:
    """Return the common meaning of words, ignoring fillers."""
    if (whole := _KNOWN.get(" ".join(words))) is not None:
        return whole
    found = {
        _KNOWN.get(word) for word in words if word not in _FILLERS and not re.fullmatch(r"utm\d*[ns]?", word)
    } or {_KNOWN[word] for word in words if word in _KNOWN}
    found = {ANGULAR.get(each or "", each) if len(found) > 1 else each for each in found}
    return found.pop() if len(found) == 1 else None


_GLUED = re.compile(r"(?:sigma|sd|std|s|m|rms)(xyz|xy|[xyzenh])")
_OF_SEVERAL = {
    "sd": "xyz, x y z, 3d",
    "sd_xy": "xy, x y, 2d, horizontal, hz, horz, planimetric, lage, lagegenauigkeit, planimetrique, hrms",
    "sd_z": "vertical, vert, hohengenauigkeit, hoehengenauigkeit, vrms",
}
_TOGETHER = {word: column for column, words in _OF_SEVERAL.items() for word in words.split(", ")}


def column_of(heading: str) -> str | None:
    """Return the column of a heading; empty if it is not needed, None if unknown."""
    words = words_of(_COVERAGE.sub(" ", heading.casefold()))
    if len(words) > 1 and words[-1] in UNITS:
        words.pop()
    if not words:
        return None
    if coverage_of(heading) is not None and (expanded := _EXPANDED.fullmatch(words[0])):
        words = ["sd", *([expanded[1]] if expanded[1] else []), *words[1:]]
    if (whole := _KNOWN.get(" ".join(words))) is not None:
        return whole
    if len(words) == 1 and (glued := _GLUED.fullmatch(words[0])):
        words = ["sd", glued[1]]
    if words[0] in ("lagegenauigkeit", "hohengenauigkeit", "hoehengenauigkeit", "hrms", "vrms"):
        return _TOGETHER[words[0]]
    for cut in range(1, len(words)):
        for deviation, rest in ((words[:cut], words[cut:]), (words[-cut:], words[:-cut])):
            if _KNOWN.get(" ".join(deviation)) == "sd":
                own = _TOGETHER.get(" ".join(rest)) or _meaning(rest)
                own = ANGULAR.get(own or "", own or "")
                if own.startswith("sd"):
                    return own
                if own in ("x", "y", "z"):
                    return f"sd_{own}"
    return _meaning(words)


def is_angular(heading: str) -> bool:
    """Return whether a heading names a longitude or latitude."""
    return any(_KNOWN.get(word) in ANGULAR for word in words_of(heading))


def units_of(heading: str) -> list[str]:
    """Return the units in a heading: in brackets, otherwise at the end."""
    inside = [_COVERAGE.sub(" ", each) for each in _BRACKETS.findall(heading.casefold())]
    found = [" ".join(each.replace("_", " ").split()).strip(" ,;") for each in inside]
    words = re.sub(r"[^0-9a-zμ-]+", " ", heading.casefold()).split()
    return [each for each in found if each] or ([words[-1]] if len(words) > 1 and words[-1] in UNITS else [])


def coverage_of(heading: str) -> float | None:
    """Return the coverage factor in a heading such as k=2; None without."""
    match = _COVERAGE.search(heading.casefold())
    return None if match is None else float(match[1].replace(",", "."))


def bare_name(heading: str, known: Collection[str]) -> str | None:
    """Return the known column of a heading, ignoring unit and coverage factor."""
    if not all(any(word in units for units in KINDS_OF_UNITS.values()) for word in units_of(heading)):
        return None
    words = _COVERAGE.sub(" ", _BRACKETS.sub(" ", heading.casefold())).replace("_", " ").split()
    names = ["_".join(words)]
    if len(words) > 1 and words[-1] in UNITS:
        names.append("_".join(words[:-1]))
    return next((each for each in names if each in known), None)


def role_of(text: str) -> str | None:
    """Return `control`, `check`, `off` or `?` (ambiguous); None for other words."""
    return _KNOWN_ROLES.get(" ".join(words_of(text)))
