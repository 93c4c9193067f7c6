#!/usr/bin/env python3
"""Holds the numbers of limits: each constant that a row of the pages of limits names has the value that stands here, and the
row says it. A constant that changes, a page that changes, and a row without a number here are faults.

usage: limits.py SOURCE_FOLDER [ignored]
Prints a line per fault and ends with 1 if there are any. Then it plants a fault of each kind, in memory, and ends with 1
unless each is found.
"""
import re
import sys
from pathlib import Path

PAGES = ("SECURITY.md", "docs/internals/limits.md", "docs/internals/more_limits.md")
# Constant, or member of a struct -> the words that its row says; its value is their number, in the unit that its name ends with.
WORDS = {
    "kMaxSessions": "256", "kMaxSessionsPerAddress": "64", "kSpareConnections": "64", "kSpareConnectionsPerAddress": "16 of one address",
    "kMaxProxyBytes": "2,048 bytes", "kMaxForwardedHops": "16", "kMaxHttpHeaderBytes": "8 KiB", "kMaxControlBytes": "64 KiB",
    "kMaxChainFrames": "240 frames", "kMaxChainBytes": "16 MiB", "kMaxWaitingMessages": "256 messages",
    "kMaxBytesOfMessage": "1 MiB", "kControlsPerS": "60 a second", "kControlBurst": "120 at once", "kMaxPendingJobs": "32", "kMostSharedVertices": "400,000",
    "kStreamChangeNs": "500 ms", "kLookChangeNs": "100 ms",
    "kLongestStepsNs": "60 s", "kMaxHeldSamples": "65,536", "kMaxInFlightBytes": "4 MiB",
    "kMaxInFlightFrames": "512 frames", "kMaxQueuedControl": "64", "kMaxSessionMemoryBytes": "8 MiB", "kMaxSessionReadBytes": "68 KiB",
    "kLeastProgressBytes": "4 KiB", "kMaxRequestsOfConnection": "100", "kMaxLogMessageChars": "2,000 characters",
    "kMaxLogLineBytes": "4,096 bytes", "kMinTokenCharacters": "16 characters",
    "kMaxJointDistanceM": "10 m", "kMaxScenarioFileBytes": "256 KiB", "kMaxScenarioActions": "1,000 actions",
    "kMaxServedCodecs": "2 codecs", "kMaxPictureViews": "8", "kMaxPictureClasses": "16", "kMaxPictureViewsOfPeer": "4 for one address",
    "kMaxPictureClassesOfPeer": "8 for one address", "kDrawnPixelBytes": "110 bytes", "kClassPixelBytes": "40 for each",
    "kMaxLiveInputs": "4", "kMotionStaleNs": "1 s", "kMaxSampleRateHz": "1,000 a second", "kMaxLiveBytesPerS": "2 million",
    "kMaxLiveSubjects": "32", "kMaxLiveSpeedMps": "10 m/s", "kMaxLiveTurnRadPerS": "25 rad/s", "kGateJumpM": "0.75 m", "kGateTurnRad": "0.6 rad", "kMaxOscBundleDepth": "4",
    "kMaxOscBundleElements": "256", "kMaxWaitingNotices": "64", "kMaxSendQueueMessages": "1,024", "kMaxSendQueueBytes": "1 MiB",
    "kMaxKeptSnapshotBytes": "256 MiB",
    "kMaxClipBytes": "2 GiB", "kMaxUpgradeAnswerBytes": "16 KiB", "kMaxHttpAnswerHeaderBytes": "16 KiB",
    "kMaxHttpBodyBytes": "1 MiB", "kMaxOutstandingPings": "32", "kClockWindow": "100", "kStageWindow": "512", "kMaxForeignLinesPerS": "20",
    "kMaxGroomReadBytes": "512 MiB", "kMaxAbcObjects": "100,000", "kMaxAbcDepth": "2,000", "kMaxUsdPrims": "100,000", "kMaxUsdDepth": "64",
    "kMaxUsdXformOps": "32", "kMaxUsdcItems": "4,000,000", "kMaxUsdcTokenBytes": "64 MiB", "kMaxUsdcFields": "64", "connections_per_s": "10 a second", "requests_per_s": "50 a second", "wrong_tokens": "5", "guarded_addresses": "1,024",
    "handshake_ms": "5 s", "messages_per_s": "1,000 a second", "stalled_ms": "4.5 s", "idle_ms": "15 s",
    "refusal_lines_per_address": "10 of one address", "refusal_lines": "300 of all", "session_lines": "1,200",
    "lines_per_kind": "4 of a kind"}
# Said in words, or of another constant; the value alone stands here.
VALUES = {
    "kMaxHttpReadBytes": 8 * 1024 + 1, "kCatchUpShare": 0.125, "kJobShare": 0.25, "kBlockingShare": 0.25,
    "wrong_token_window_ms": 60e3, "wrong_token_block_ms": 60e3}
# A row names these by their header.
OF_HEADER = {"server/relay/uplinks.h": {
    "kMaxUplinks": "40 of viewers", "kMaxWatchersUplinks": "24 watchers", "kMaxUplinksPerAddress": "of one address 12", "kSpeakAgainNs": "2 s",
    "kIdleUplinkNs": "90 s"}}
# Structs, or of two values in two places: their tests have them (PictureViews, LiveMocap, SnapshotTimeline, ClientHostile and the like).
ELSEWHERE = {"kHardwareBudget", "kSoftwareBudget", "kReservedPictureClasses", "kMaxDatagramBytes", "kMaxMessageBytes", "kKeptSnapshots",
             "kMaxShownChars", "kStopGrace", "kFarewellTimeout", "kDoubtedServer"}
MULTIPLES = {"KiB": 1 << 10, "MiB": 1 << 20, "GiB": 1 << 30, "million": 10**6}
# Units by the end of a name: what a second, or a millisecond, is of them.
TIMES = {"Ns": {"s": 1e9, "ms": 1e6}, "_ms": {"s": 1e3, "ms": 1}}


class Source:
    def __init__(self, root):
        self.pages = {page: (root / page).read_text() for page in PAGES}
        self.read("\n".join(path.read_text(errors="replace") for top in ("common", "server", "client")
                            for path in sorted((root / top).rglob("*")) if path.suffix in (".h", ".cpp")))

    def read(self, code):
        """Constants, and members with a first value: name -> what stands behind it, of each place."""
        self.code, self.first = code, {}
        for name, text in re.findall(r"(?:constexpr [\w:]+|\n  (?:u?int\d+_t|double)) (\w+) =\s*([^;{}]+);", code):
            self.first.setdefault(name, set()).add(text)

    def rows(self):
        """(limit, held by) of each row."""
        for text in self.pages.values():
            for line in text.splitlines():
                cells = [cell.strip() for cell in line.split(" | ")]
                if line.startswith("| ") and len(cells) == 3:
                    yield cells[1], cells[2]

    def value(self, name):
        """Of a constant or a member; None where there is none, or there are several."""
        found = self.first.get(name, ())
        if len(found) != 1:
            return None
        text = re.sub(r"(?<=\d)'(?=\d)", "", next(iter(found)))
        text = re.sub(r"\b(\d[\d.]*(?:e\d+)?)(?:u|ull|ll|f)?\b", r"\1", text)
        text = re.sub(r"\bk[A-Z]\w+", lambda other: str(self.value(other.group())), text)
        return eval(text.replace("/", "//"), {"__builtins__": {}}) if re.fullmatch(r"[\d.e+*/<>() -]+", text) else None  # noqa: S307


def number(words, name):
    """The number that stands in the words, in the unit of the name."""
    found = re.search(r"([\d][\d,.]*)(?: (KiB|MiB|GiB|million|ms|s)\b)?", words)
    value = float(found.group(1).replace(",", ""))
    if found.group(2) in MULTIPLES:
        return value * MULTIPLES[found.group(2)]
    for end, times in TIMES.items():
        if name.endswith(end) and found.group(2) in times:
            return value * times[found.group(2)]
    return value


def faults(source):
    rows = list(source.rows())
    expected = {**WORDS, **{name: words for group in OF_HEADER.values() for name, words in group.items()}}
    for name, value in {**{name: number(words, name) for name, words in expected.items()}, **VALUES}.items():
        if source.value(name) != value:
            yield f"{name} is {source.value(name)}, not {value:g}"
    for name, words in expected.items():
        key = next((header for header, group in OF_HEADER.items() if name in group), name)
        said = [limit for limit, held in rows if re.search(rf"`{re.escape(key)}`", held)]
        if not any(re.search(rf"(?<![\d,.]){re.escape(words)}(?![\d]|,\d)", limit) for limit in said):
            yield f"{name}: no row that names {key} says '{words}': {said}"
    for name in sorted(ELSEWHERE):
        if not re.search(rf"\b{name}\b", source.code):
            yield f"{name} is in no file of the product"
    for limit, held in rows:
        for name in re.findall(r"`(k[A-Z]\w+)`", held):
            if name not in WORDS and name not in VALUES and name not in ELSEWHERE:
                yield f"{name} ({limit}) has no number in tests/tidy/limits.py"


def planted(source, code=(), page=()):
    other = Source.__new__(Source)
    other.read(source.code.replace(*code) if code else source.code)
    other.pages = {name: text.replace(*page) for name, text in source.pages.items()} if page else source.pages
    return list(faults(other))


PLANTS = {
    "a constant": {"code": ("kMaxUplinks = 40", "kMaxUplinks = 41")},
    "a unit": {"code": ("kMaxChainBytes = 16u << 20", "kMaxChainBytes = 16u << 10")},
    "a member": {"code": ("stalled_ms = 4'500", "stalled_ms = 4'600")},
    "a time": {"code": ("kSpeakAgainNs = 2'000'000'000", "kSpeakAgainNs = 200'000'000")},
    "a page": {"page": ("65,536, then refused", "65,535, then refused")},
    "a name": {"code": ("kStopGrace", "kOtherGrace")},
    "a row": {"page": ("`kMaxHeldSamples`", "`kMaxOtherSamples`")}}


def main():
    source = Source(Path(sys.argv[1]))
    found = list(faults(source))
    if not found:
        found = [f"a planted fault is not found: {name}" for name, plant in PLANTS.items() if not planted(source, **plant)]
    for fault in found:
        print(fault)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
