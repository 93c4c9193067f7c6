// What stands behind the # of the page's address: a token, which is taken out of it at once, and what a link to a
// view says. Nothing of it is ever sent but the token, in the Hello.
import type { Camera, Vec3 } from './messages';

export interface Wishes {
  token: string;
  keepsToken: boolean; // over a reload, as long as the tab is open
  mode: number; // of wire.ts; auto where nothing is said
  camera?: Camera;
  codec: string;
  head: string; // which one of the server's; empty: the first
  draw: string; // "gl" or "tiles" insists
  pictures: string; // jpeg, tiles, vp8 or h264 insists on one of these
  isViewOnly: boolean;
  size?: { width: number; height: number };
}

const MODES: { [name: string]: number } = { strands: 0, pictures: 1, frames: 1, auto: 2 };
const DIGITS = 4;

/** Sizes of pictures that a server draws, pixels (WIRE.md, section 7). */
const LEAST_SIDE = 16;
const MOST_WIDTH = 3840;
const MOST_HEIGHT = 2160;

export function readFragment(fragment: string): Wishes {
  const words = new URLSearchParams(fragment.replace(/^#/, ''));
  const wishes: Wishes = {
    token: words.get('token') ?? '', keepsToken: words.has('keep-token'), mode: MODES[words.get('mode') ?? 'auto'] ?? 2, codec: words.get('codec') ?? '',
    head: words.get('head') ?? '', draw: words.get('draw') ?? '', pictures: words.get('pictures') ?? '', isViewOnly: words.has('view-only'),
  };
  const numbers = (words.get('view') ?? '').split(',').map(Number);
  if (numbers.length === 7 && numbers.every(Number.isFinite) && Math.hypot(numbers[0]!, numbers[1]!, numbers[2]!) > 0.01 &&
      numbers[6]! > 0.02 && numbers[6]! < 2.8)
    wishes.camera = { offset: numbers.slice(0, 3) as Vec3, target: numbers.slice(3, 6) as Vec3, fov: numbers[6]! };
  const size = /^(\d+)x(\d+)$/.exec(words.get('size') ?? '');
  const within = (side: string, most: number) => Math.min(Math.max(Number(side), LEAST_SIDE), most);
  if (size) wishes.size = { width: within(size[1]!, MOST_WIDTH), height: within(size[2]!, MOST_HEIGHT) };
  return wishes;
}

/** The fragment without its token. */
export function withoutToken(fragment: string): string {
  const words = new URLSearchParams(fragment.replace(/^#/, ''));
  words.delete('token');
  const rest = words.toString().replace(/=(?=&|$)/g, '').replace(/%2C/g, ',');
  return rest ? `#${rest}` : '';
}

export function linkTo(base: string, camera: Camera, mode: number, head = ''): string {
  const view = [...camera.offset, ...camera.target, camera.fov].map((n) => Number(n.toFixed(DIGITS))).join(',');
  const name = Object.keys(MODES).find((one) => MODES[one] === mode);
  return `${base}#view=${view}${name && name !== 'auto' ? `&mode=${name}` : ''}${head && `&head=${encodeURIComponent(head)}`}`;
}

const KEPT_TOKEN = `strandcast-token ${typeof location === 'undefined' ? '' : location.pathname}`;

/** The token that this tab keeps for this page; empty where it keeps none, or may keep nothing. */
export function keptToken(): string {
  try {
    return sessionStorage.getItem(KEPT_TOKEN) ?? '';
  } catch {
    return '';
  }
}

/** Keeps a token for this tab alone, until it is closed; an empty one forgets. */
export function keepToken(token: string): void {
  try {
    if (token) sessionStorage.setItem(KEPT_TOKEN, token);
    else sessionStorage.removeItem(KEPT_TOKEN);
  } catch {
    // Storage is switched off: the tab asks again after a reload.
  }
}
