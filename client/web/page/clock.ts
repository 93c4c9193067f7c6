// Offset between this page's clock and the server's, as common/replay/clock_offset.h: of the last hundred probes
// the one with the shortest round trip tells.
export class ClockOffset {
  private probes: { offset: number; roundTrip: number }[] = [];

  add(clientSendNs: number, serverReceiveNs: number, serverSendNs: number, clientReceiveNs: number): void {
    const elapsed = clientReceiveNs - clientSendNs;
    const held = serverSendNs - serverReceiveNs;
    if (!(elapsed >= 0 && held >= 0 && held <= elapsed && elapsed - held <= 10e9)) return;
    this.probes.push({
      offset: (serverReceiveNs - clientSendNs + (serverSendNs - clientReceiveNs)) / 2,
      roundTrip: elapsed - held,
    });
    if (this.probes.length > 100) this.probes.shift();
  }
  private best(): { offset: number; roundTrip: number } | undefined {
    let best = this.probes[0];
    for (const probe of this.probes) if (probe.roundTrip < best!.roundTrip) best = probe;
    return best;
  }
  get hasValue(): boolean {
    return this.probes.length > 0;
  }
  toServerNs(clientNs: number): number {
    return clientNs + (this.best()?.offset ?? 0);
  }
  get roundTripMs(): number {
    return (this.best()?.roundTrip ?? 0) * 1e-6;
  }
}

/** Nanoseconds of a clock that never runs back. */
export function nowNs(): number {
  return Math.round(performance.now() * 1e6);
}

/** Median of the newest values. */
export class Recent {
  private values: number[] = [];
  constructor(private readonly most = 60) {}
  add(value: number): void {
    this.values.push(value);
    if (this.values.length > this.most) this.values.shift();
  }
  clear(): void {
    this.values = [];
  }
  get median(): number {
    const sorted = [...this.values].sort((a, b) => a - b);
    return sorted[Math.floor(sorted.length / 2)] ?? 0;
  }
}

type Timecode = { rate_numerator: number; rate_denominator: number; is_drop: boolean; frame: number };

/** 01:02:03:04, or 01:02:03;04 where numbers are left out (SMPTE ST 12-1). */
export function timecodeText({ rate_numerator, rate_denominator, is_drop, frame }: Timecode): string {
  const count = Math.ceil(rate_numerator / rate_denominator);
  const dropped = is_drop ? count / 15 : 0;
  const minute = 60 * count;
  const ten = 10 * minute - 9 * dropped;
  const rest = frame % ten;
  const minutes = 9 * Math.floor(frame / ten) + (rest < minute ? 0 : Math.floor((rest - minute) / (minute - dropped)) + 1);
  const number = frame + dropped * minutes;
  const seconds = Math.floor(number / count);
  const two = (value: number): string => String(value).padStart(2, '0');
  return `${two(Math.floor(seconds / 3600))}:${two(Math.floor(seconds / 60) % 60)}:${two(seconds % 60)}${is_drop ? ';' : ':'}${two(number % count)}`;
}
