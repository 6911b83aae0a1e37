#!/usr/bin/env python3
"""Makes the lines of src/material/metals.rs from measured spectra.

    python3 benches/metals.py DATABASE

DATABASE is a checkout of https://github.com/polyanskiy/refractiveindex.info-database (CC0 1.0). It needs the package
colour-science from PyPI, for the CIE 1931 2-degree observer and illuminant D65.

A channel's index is the mean of the spectrum from 380 nm to 780 nm, by the weights that a reflectance spectrum under D65
has in that channel of linear Rec. 709. The reflectances at normal incidence of both are printed beside the lines.
"""

import bisect
import pathlib
import re
import sys

import colour

METALS = {
    "aluminium": ("main/Al/nk/Rakic", "Rakić 1995"),
    "beryllium": ("main/Be/nk/Rakic-BB", "Rakić et al. 1998, Brendel–Bormann"),
    "brass": ("other/alloys/Cu-Zn/nk/Querry-Cu70Zn30", "Querry 1985, Cu70Zn30"),
    "chromium": ("main/Cr/nk/Johnson", "Johnson and Christy 1974"),
    "cobalt": ("main/Co/nk/Johnson", "Johnson and Christy 1974"),
    "copper": ("main/Cu/nk/Johnson", "Johnson and Christy 1972"),
    "gold": ("main/Au/nk/Johnson", "Johnson and Christy 1972"),
    "iron": ("main/Fe/nk/Johnson", "Johnson and Christy 1974"),
    "lead": ("main/Pb/nk/Mathewson-298K", "Mathewson and Myers 1971"),
    "manganese": ("main/Mn/nk/Johnson", "Johnson and Christy 1974"),
    "mercury": ("main/Hg/nk/Inagaki", "Inagaki et al. 1981"),
    "nickel": ("main/Ni/nk/Johnson", "Johnson and Christy 1974"),
    "niobium": ("main/Nb/nk/Weaver", "Weaver et al. 1973"),
    "palladium": ("main/Pd/nk/Johnson", "Johnson and Christy 1974"),
    "platinum": ("main/Pt/nk/Rakic-BB", "Rakić et al. 1998, Brendel–Bormann"),
    "rhodium": ("main/Rh/nk/Weaver", "Weaver et al. 1977"),
    "silver": ("main/Ag/nk/Johnson", "Johnson and Christy 1972"),
    "titanium": ("main/Ti/nk/Johnson", "Johnson and Christy 1974"),
    "tungsten": ("main/W/nk/Weaver", "Weaver et al. 1975"),
    "vanadium": ("main/V/nk/Johnson", "Johnson and Christy 1974"),
}

NANOMETRES = range(380, 781)

# From XYZ to linear Rec. 709 with its white point D65.
REC_709 = [
    (3.2404542, -1.5371385, -0.4985314),
    (-0.9692660, 1.8760108, 0.0415560),
    (0.0556434, -0.2040259, 1.0572252),
]


def weights():
    observer = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"]
    daylight = colour.SDS_ILLUMINANTS["D65"].copy().align(colour.SpectralShape(380, 780, 1))
    for row in REC_709:
        own = [sum(m * c for m, c in zip(row, observer[nm])) * daylight[nm] for nm in NANOMETRES]
        total = sum(own)
        yield [weight / total for weight in own]


def at(points, nm):
    """The straight line between the points around a wavelength."""
    place = min(max(bisect.bisect_right(points, (nm,)), 1), len(points) - 1)
    (left, a), (right, b) = points[place - 1], points[place]
    return a + (b - a) * min(max((nm - left) / (right - left), 0.0), 1.0)


def reflectance(eta, k):
    return ((eta - 1) ** 2 + k * k) / ((eta + 1) ** 2 + k * k)


def main():
    database = pathlib.Path(sys.argv[1]) / "database/data"
    channels = list(weights())
    for name, (path, source) in METALS.items():
        text = (database / f"{path}.yml").read_text(encoding="utf-8")
        rows = re.findall(r"^\s+([0-9.eE+-]+)\s+([0-9.eE+-]+)\s+([0-9.eE+-]+)\s*$", text, re.MULTILINE)
        rows = sorted([1000 * float(um), float(eta), float(k)] for um, eta, k in rows)
        spectra = [[at([(row[0], row[i]) for row in rows], nm) for nm in NANOMETRES] for i in (1, 2)]
        mean = lambda spectrum: [sum(w * x for w, x in zip(own, spectrum)) for own in channels]
        eta, k = mean(spectra[0]), mean(spectra[1])
        print(f"    // {source}.")
        print(f'    "{name}": {[round(x, 4) for x in eta]}, {[round(x, 4) for x in k]};')
        whole = mean([reflectance(*pair) for pair in zip(*spectra)])
        ours = [reflectance(*pair) for pair in zip(eta, k)]
        print([round(x, 3) for x in whole], [round(x, 3) for x in ours], file=sys.stderr)


if __name__ == "__main__":
    main()
