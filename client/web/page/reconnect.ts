// When to come back after a connection ended, as common/client/reconnect_policy.h, and what close codes mean
// (proto/WIRE.md, section 9).
const FIRST_MS = 250;
const LONGEST_MS = 5000;
const JITTER = 0.2;
const STABLE_MS = 10_000;

/** What a person reads where the server said nothing. */
export function wordsFor(code: number, wasOpen: boolean): string {
  switch (code) {
    case 1001: return 'the server is going away';
    case 1002: case 1007: return 'one of both sides did not keep to the protocol';
    case 1008: return 'the server does not allow this';
    case 1009: return 'a message was too long for the server';
    case 1011: return 'the server failed in this session';
    case 1013: return 'the server has no room for this now';
    case 4001: return 'the token was refused';
    case 4002: return 'an administrator ended this session';
    case 4003: return 'the server is full';
    default: return wasOpen ? 'the connection was lost' : 'no server answers here';
  }
}

export function mayComeBack(code: number): boolean {
  return ![1002, 1003, 1007, 1008, 1009, 4001, 4002, 4003].includes(code);
}

export class ReconnectPolicy {
  private attempts = 0;
  constructor(private readonly random: () => number = Math.random) {}
  nextDelayMs(connectedForMs: number): number {
    if (connectedForMs >= STABLE_MS) this.attempts = 0;
    const doubled = FIRST_MS * 2 ** Math.min(this.attempts++, 16);
    return Math.min(doubled, LONGEST_MS) * (1 + JITTER * (2 * this.random() - 1));
  }
}
