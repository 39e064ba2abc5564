#!/usr/bin/env python3
"""math_font.py <latinmodern-math.otf> <math.woff2>: the part of Latin Modern Math that pages embed. Needs fontTools and
brotli (python3-fonttools, python3-brotli) and the package fonts-lmodern; run by hand when a sign is missing."""
import sys

from fontTools import subset
from fontTools.ttLib import TTFont

SIGNS = """20-7E A0-FF 131 237 2B9-2DD 300-30C 338 391-3C9 3D1 3D5 3D6 3F0 3F1 3F5 2016 2018-201D 2020-2022 2026 2032-2037
2044 2057 2061-2064 20D6 20D7 20DB 20DC 2102 210A-2115 2119-2124 211A-211D 2128 212C-2131 2133 2190-2199 21A6 21D0-21D4
2200-222B 222C-222E 2234-2237 223C 2243 2245 2248 2250 2260-2265 226A 226B 2282-2287 2295-2299 22A4 22A5 22C0-22C6
22EE-22F1 2308-230B 2320 2321 239B-23AE 23DC-23E1 25A1 25CF 27E8-27EF 2A7D 2A7E 1D400-1D467 1D468-1D49B 1D49C-1D4CF
1D538-1D56B 1D6A4 1D6A5 1D6A8-1D71B 1D71C-1D755 1D7CE-1D7D7"""

PRIMES = [0x2032, 0x2033, 0x2034, 0x2057]


def code_points():
    for word in SIGNS.split():
        first, _, last = word.partition("-")
        yield from range(int(first, 16), int(last or first, 16) + 1)


def set_primes_for_scripts(font):
    """Primes stand in scripts, for which the font has variants (feature ssty) that browsers do not choose: the
    variants take the place of the signs."""
    variants = {}
    for lookup in font["GSUB"].table.LookupList.Lookup:
        for table in lookup.SubTable:
            table = getattr(table, "ExtSubTable", table)
            variants.update(getattr(table, "alternates", {}))
    for table in font["cmap"].tables:
        for code in PRIMES:
            if table.cmap.get(code) in variants:
                table.cmap[code] = variants[table.cmap[code]][0]


def main(source, target):
    font = TTFont(source)
    set_primes_for_scripts(font)
    options = subset.Options(flavor="woff2", hinting=False, layout_features=[])
    options.drop_tables += ["FFTM"]
    work = subset.Subsetter(options)
    work.populate(unicodes=list(code_points()))
    work.subset(font)
    font.flavor = "woff2"
    subset.save_font(font, target, options)


main(*sys.argv[1:])
