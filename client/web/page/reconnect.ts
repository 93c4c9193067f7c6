// When to come back after a connection ended: the numbers and rules of common/client/reconnect_policy.h, whose test
// (tests/unit/client_net_test.cpp) compares them with these, and what close codes mean (proto/WIRE.md, section 9).
const FIRST_MS = 250;
const LONGEST_MS = 5000;
/** Longest delay of the first attempts. */
const URGENT_MS = 500;
const URGENT_ATTEMPTS = 60;
const JITTER = 0.25;
const STABLE_MS = 2_000;
const LASTING_MS = 10_000; // a silent connection that was left sooner is given longer the next time
/** Nothing heard for so long: a new connection is tried beside this one, and takes its place unless it speaks first. */
export const DOUBTED_MS = 1500;
/** Nothing heard for so long: "not connected" is shown. */
export const SILENT_MS = 3000;
/** Nothing heard for so long: the connection is dead, as ClientConfig has it. */
export const IDLE_MS = 15_000;
/** From the first attempt to the Welcome, as connecting and Welcome of ClientConfig together. */
export const WELCOME_MS = 10_000;
/** Token refused, ended by an admin, role too low. */
const FINAL_CODES = [4001, 4002, 4004];
/** No head of this name: a typing error of who has never been in. */
const UNKNOWN_CODE = 4005;
/** The page's own: the connection was given up. */
export const GIVEN_UP_CODE = 4000;

/** Longest texts of a Hello, in bytes of UTF-8. */
const TOKEN_BYTES = 256;
const NAME_BYTES = 64;

/** What is wrong with a Hello that every server refuses, in a sentence; empty when nothing is. */
export function faultOf(asked: { token: string; head: string; codec: string; name?: string }): string {
  const isLonger = (text: string, limit: number) => new TextEncoder().encode(text).length > limit;
  if (isLonger(asked.token, TOKEN_BYTES)) return `the token is longer than ${TOKEN_BYTES} bytes`;
  for (const [word, text] of [['head', asked.head], ['codec', asked.codec], ['own name', asked.name ?? '']] as const)
    if (isLonger(text, NAME_BYTES)) return `the ${word} is longer than ${NAME_BYTES} bytes`;
  return '';
}

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
    case 4004: return 'the token is not good for this role';
    case 4005: return 'there is no such head';
    default: return wasOpen ? 'the connection was lost' : 'no server answers here';
  }
}

export function mayComeBack(code: number, wasIn: boolean): boolean {
  return !FINAL_CODES.includes(code) && (wasIn || code !== UNKNOWN_CODE);
}

export class ReconnectPolicy {
  private attempts = 0;
  /** Nothing heard for so long: another connection is tried. */
  doubtMs = DOUBTED_MS;
  constructor(private readonly random: () => number = Math.random) {}
  /** A silent connection was left for another. Where that happens soon again, long messages over a slow link look like silence. */
  replace(connectedForMs: number): void {
    this.doubtMs = connectedForMs >= LASTING_MS ? DOUBTED_MS : 2 * this.doubtMs;
  }
  nextDelayMs(connectedForMs: number): number {
    if (connectedForMs >= STABLE_MS) this.attempts = 0;
    const longestMs = this.attempts < URGENT_ATTEMPTS ? URGENT_MS : LONGEST_MS;
    const doubled = FIRST_MS * 2 ** Math.min(this.attempts++, 16);
    return Math.min(doubled, longestMs) * (1 + JITTER * (2 * this.random() - 1));
  }
}
