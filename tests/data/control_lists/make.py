"""Make the lists of control and the block that they belong to: all numbers are invented.

`photogram simulate blk --strips 2 --photos-per-strip 3 --points-per-photo 20 --flying-height 120 --relief 12
--control-sd 0.01 --control corners --check-points 3 --position-error 1 --image-sd 0.003`, then `photogram
convert blk plain`; `python tests/data/control_lists/make.py plain` makes a block without control of it,
and its control as eleven people would send it: in a plane of large numbers, or as positions on the earth
(needs pyproj).
"""

import sys
from pathlib import Path

import numpy as np
import pandas as pd

HERE = Path(__file__).parent
SHIFT = np.array([3_461_200.0, 5_412_300.0, 430.0])
ORIGIN = (48.8666, 8.4711, 430.0)
"""Of the block on the earth: latitude, longitude, height."""


def make(plain: Path) -> None:
    control = pd.read_csv(plain / "control.csv", comment="#")
    names = {name: str(101 + k) for k, name in enumerate(control["point"])}
    check = (control["use"] == "check").tolist()
    ids, xyz = list(names.values()), control[["x", "y", "z"]].to_numpy()
    images = pd.read_csv(plain / "images.csv", dtype={"photo": str})
    images["point"] = images["point"].replace(names)
    images.to_csv(HERE / "block" / "images.csv", index=False)
    columns = ["photo", "x", "y", "z", "omega", "phi", "kappa"]
    photos = pd.read_csv(plain / "photos.csv", dtype={"photo": str})[columns].round(3)
    photos.to_csv(HERE / "block" / "photos.csv", index=False)
    camera = pd.read_csv(plain / "cameras.csv")[["camera", "model", "c"]]
    camera.to_csv(HERE / "block" / "cameras.csv", index=False)
    settings = '[project]\nformat = 1\nname = "invented"\n[units]\nimage = "mm"\n'
    (HERE / "block" / "project.toml").write_text(settings)
    lists(ids, xyz, check)


def lists(ids: list[str], xyz: np.ndarray, check: list[bool]) -> None:
    plane = xyz + SHIFT
    lon, lat, height = on_earth(xyz).T

    def table(head, row, delimiter=";"):
        return "\n".join([head, *(delimiter.join(row(k)) for k in range(len(ids))), ""])

    def number(value, decimal=".", thousands="", digits=4):
        return f"{value:,.{digits}f}".replace(",", "T").replace(".", decimal).replace("T", thousands)

    def three(k, **marks):
        return [number(value, **marks) for value in plane[k]]

    def angle(value, letters):
        minutes = abs(value) % 1 * 60
        return f"{int(abs(value))}° {int(minutes):02}' {minutes % 1 * 60:09.6f}\" {letters[int(value < 0)]}"

    role = [
        dict(zip(("gcp", "de", "fr", "cp"), each, strict=True))
        for each in zip(
            *(
                [words[k] for k in check]
                for words in (("GCP", "Check"), ("Passpunkt", "KP"), ("Appui", "Contrôle"), ("GCP", "CP"))
            ),
            strict=True,
        )
    ]
    texts = {
        "german_bom.csv": "\ufeff"
        + table("Punkt;Rechtswert;Hochwert;Höhe", lambda k: [ids[k], *three(k, decimal=",")]),
        "thousands.csv": table(
            "Punkt-Nr.;Rechtswert [m];Hochwert [m];Hoehe [m];Genauigkeit [m];Punktart",
            lambda k: [ids[k], *three(k, decimal=",", thousands="."), "0,01", role[k]["de"]],
        ),
        "swiss.csv": table(
            "Name;Ost;Nord;Höhe;sigma;Typ",
            lambda k: [ids[k], *three(k, thousands="'"), "0.01", role[k]["cp"]],
        ),
        "pnezd.txt": "\n".join(
            ",".join([ids[k], *(three(k)[axis] for axis in (1, 0, 2)), role[k]["gcp"]])
            for k in range(len(ids))
        ),
        "dbat.txt": "# Control of the hall\n"
        + table(
            "# Id, name, X, Y, Z, sigmaX, sigmaY, sigmaZ",
            lambda k: [str(k + 1), ids[k], *(number(v) for v in xyz[k]), "0.01", "0.01", "0.02"],
            ", ",
        ),
        "wider.txt": table("Easting\tNorthing\tHeight\tsd", lambda k: [ids[k], *three(k), "0.01"], "\t"),
        "lat_lon.csv": table(
            "name,lat,lon,ellipsoidal height,accuracy,type",
            lambda k: [ids[k], f"{lat[k]:.9f}", f"{lon[k]:.9f}", f"{height[k]:.4f}", "0.01", role[k]["gcp"]],
            ",",
        ),
        "degrees_minutes.csv": table(
            "Point ID;Latitude;Longitude;Height (m);Horizontal accuracy;Vertical accuracy;Check",
            lambda k: [
                ids[k],
                angle(lat[k], "NS"),
                angle(lon[k], "EW"),
                f"{height[k]:.4f}",
                "0.01",
                "0.01",
                "yes" if check[k] else "",
            ],
        ),
    }
    for name, text in texts.items():
        (HERE / name).write_bytes(text.replace("\n", "\r\n").encode())
    umlauts = "Koordinatenverzeichnis Halde;;;;\nPunkt;Rechtswert;Hochwert;Höhe;Bemerkung\n" + "".join(
        ";".join([ids[k], *three(k, decimal=","), "Bolzen in Mauer"]) + "\n" for k in range(len(ids))
    )
    (HERE / "german_latin1.csv").write_bytes(umlauts.encode("latin-1"))
    excel = table(
        "Name\tEasting (m)\tNorthing (m)\tElevation (m)\tType",
        lambda k: [ids[k], *three(k), role[k]["gcp"]],
        "\t",
    )
    (HERE / "excel_utf16.txt").write_bytes(excel.replace("\n", "\r\n").encode("utf-16"))
    french = table(
        "Nom;Est;Nord;Altitude;Précision;Rôle",
        lambda k: [ids[k], *three(k, decimal=",", thousands="\u00a0"), "0,01", role[k]["fr"]],
    )
    (HERE / "french.csv").write_bytes(french.encode("cp1252"))


def on_earth(xyz: np.ndarray) -> np.ndarray:
    import pyproj

    pipeline = pyproj.Transformer.from_pipeline(
        f"+proj=pipeline +step +inv +proj=topocentric +ellps=WGS84 +lat_0={ORIGIN[0]} +lon_0={ORIGIN[1]}"
        f" +h_0={ORIGIN[2]} +step +inv +proj=cart +ellps=WGS84 +step +proj=unitconvert +xy_in=rad +xy_out=deg"
    )
    return np.column_stack(pipeline.transform(*xyz.T))


if __name__ == "__main__":
    make(Path(sys.argv[1]))
