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
