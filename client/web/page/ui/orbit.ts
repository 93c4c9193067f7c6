// The camera about the head, as client/window/orbit_camera.h, and what moves it: mouse, touch, keyboard.
import type { Camera, Vec3 } from '../messages';
import type { CameraMessage } from '../wire';

const RAD_PER_HEIGHT = 3.1416;
const MOST_PITCH = 1.5;
const ZOOM_PER_STEP = 0.88;
const LEAST_M = 0.12;
const MOST_M = 30;
const MOST_PAN_M = 10;

const length = (v: Vec3): number => Math.hypot(...v);
const scaled = (v: Vec3, by: number): Vec3 => [v[0] * by, v[1] * by, v[2] * by];
const cross = (a: Vec3, b: Vec3): Vec3 => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const clamp = (x: number, low: number, high: number): number => Math.min(Math.max(x, low), high);

const toScene = (v: { x: number; y: number; z: number } | undefined, otherwise: Vec3): Vec3 => (v ? [v.x, v.y, v.z] : otherwise);
/** As a server tells it; a usual one where it tells none. */
export function cameraOf(message: CameraMessage | undefined): Camera {
  const offset = toScene(message?.offset_m, [0.22, 0.07, 0.62]);
  return {
    offset: length(offset) > LEAST_M ? offset : [0.22, 0.07, 0.62],
    target: toScene(message?.target_m, [0, -0.055, 0]), fov: message?.fov_y_rad || 0.61,
  };
}

/** Farther away where the window is higher than wide: a head is as wide as the scene's author saw it. `shape`: width by height. */
export function fittedTo(camera: Camera, shape: number): Camera {
  return { ...camera, offset: scaled(camera.offset, clamp(0.85 / shape, 1, 2)) };
}

/** `x`, `y`: dragged, in heights of the window. */
export function orbit(camera: Camera, x: number, y: number): Camera {
  const distance = length(camera.offset);
  const yaw = Math.atan2(camera.offset[0], camera.offset[2]) - x * RAD_PER_HEIGHT;
  const pitch = clamp(Math.asin(clamp(camera.offset[1] / distance, -1, 1)) + y * RAD_PER_HEIGHT, -MOST_PITCH, MOST_PITCH);
  const level = Math.cos(pitch);
  return { ...camera, offset: scaled([level * Math.sin(yaw), Math.sin(pitch), level * Math.cos(yaw)], distance) };
}

export function pan(camera: Camera, x: number, y: number): Camera {
  const forward = scaled(camera.offset, -1 / length(camera.offset));
  let right = cross(forward, [0, 1, 0]);
  right = length(right) < 1e-4 ? [1, 0, 0] : scaled(right, 1 / length(right));
  const up = cross(right, forward);
  const visible = 2 * length(camera.offset) * Math.tan(0.5 * camera.fov);
  const target = camera.target.map((at, i) => clamp(at + visible * (y * up[i]! - x * right[i]!), -MOST_PAN_M, MOST_PAN_M));
  return { ...camera, target: target as Vec3 };
}

export function zoom(camera: Camera, steps: number): Camera {
  const distance = length(camera.offset);
  const wanted = clamp(distance * ZOOM_PER_STEP ** steps, LEAST_M, MOST_M);
  return { ...camera, offset: scaled(camera.offset, wanted / distance) };
}

export interface Preset {
  name: string;
  /** From the scene's own camera. */
  from(home: Camera): Camera;
}
const around = (yaw: number, pitch: number) => (home: Camera): Camera => {
  const level = Math.cos(pitch);
  return { ...home, offset: scaled([level * Math.sin(yaw), Math.sin(pitch), level * Math.cos(yaw)], length(home.offset)) };
};
export const presets: readonly Preset[] = [
  { name: 'scene', from: (home) => home },
  { name: 'front', from: around(0, 0.08) },
  { name: 'left', from: around(-Math.PI / 2, 0.08) },
  { name: 'right', from: around(Math.PI / 2, 0.08) },
  { name: 'back', from: around(Math.PI, 0.08) },
  { name: 'above', from: around(0.2, 1.3) },
  { name: 'near', from: (home) => zoom(home, 6) },
];

interface Point {
  x: number; // pixels
  y: number;
}
interface Moves {
  change(move: (camera: Camera) => Camera): void;
  /** Fingers or buttons went down or up. */
  hold(isHeld: boolean): void;
}

/** Mouse, touch and keys over `stage`. */
export function followPointers(stage: HTMLElement, moves: Moves): void {
  const pointers = new Map<number, Point>();
  stage.addEventListener('contextmenu', (event) => event.preventDefault());
  stage.addEventListener('pointerdown', (event) => {
    stage.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    stage.classList.add('dragging');
    moves.hold(true);
  });
  const rest = (): void => {
    if (pointers.size || !stage.classList.contains('dragging')) return;
    stage.classList.remove('dragging');
    moves.hold(false);
  };
  const end = (event: PointerEvent): void => {
    pointers.delete(event.pointerId);
    rest();
  };
  for (const kind of ['pointerup', 'pointercancel', 'lostpointercapture'] as const) stage.addEventListener(kind, end);
  addEventListener('blur', () => {
    pointers.clear();
    rest();
  });
  stage.addEventListener('pointermove', (event) => {
    const before = pointers.get(event.pointerId);
    if (!before) return;
    if (!event.buttons) return end(event); // let go of somewhere else
    const now = { x: event.clientX, y: event.clientY };
    const x = (now.x - before.x) / stage.clientHeight;
    const y = (now.y - before.y) / stage.clientHeight;
    const other = [...pointers].find(([id]) => id !== event.pointerId)?.[1];
    pointers.set(event.pointerId, now);
    if (other) {
      const [was, is] = [before, now].map((at) => ({ x: at.x - other.x, y: at.y - other.y })) as [Point, Point];
      const ratio = Math.hypot(is.x, is.y) / Math.max(Math.hypot(was.x, was.y), 1);
      const twist = Math.atan2(was.x * is.y - was.y * is.x, was.x * is.x + was.y * is.y);
      moves.change((camera) => orbit(zoom(pan(camera, x / 2, y / 2), -Math.log(ratio) / Math.log(ZOOM_PER_STEP)), twist / RAD_PER_HEIGHT, 0));
    } else if (event.buttons & 6 || event.shiftKey) moves.change((camera) => pan(camera, x, y));
    else moves.change((camera) => orbit(camera, x, y));
  });
  stage.addEventListener('wheel', (event) => {
    event.preventDefault();
    const lines = event.deltaMode === WheelEvent.DOM_DELTA_LINE ? event.deltaY / 3 : event.deltaY / 100;
    moves.change((camera) => zoom(camera, -clamp(lines, -4, 4)));
  }, { passive: false });
}

const ARROWS: { [key: string]: [number, number] } = {
  ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1],
};

/** True where the key moved the camera. */
export function followKey(event: KeyboardEvent, moves: Moves): boolean {
  const arrow = ARROWS[event.key];
  const step = 0.03;
  if (arrow && event.shiftKey) moves.change((camera) => pan(camera, -arrow[0] * step, arrow[1] * step));
  else if (arrow) moves.change((camera) => orbit(camera, -arrow[0] * step, arrow[1] * step));
  else if (event.key === '+' || event.key === '=') moves.change((camera) => zoom(camera, 1));
  else if (event.key === '-' || event.key === '_') moves.change((camera) => zoom(camera, -1));
  else return false;
  return true;
}
