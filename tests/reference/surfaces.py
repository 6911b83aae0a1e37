#!/usr/bin/env python3
"""Renders metals.toml and frosted.toml with Mitsuba 3: surfaces.py [SPP]. posed.py says what it needs."""
import sys

from posed import render

if __name__ == "__main__":
    for name in ("metals", "frosted"):
        render(name, int(sys.argv[1]) if len(sys.argv) > 1 else 8192)
