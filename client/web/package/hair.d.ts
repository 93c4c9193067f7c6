// strandcast/three: a stream as an object of three.js (111 or later, WebGL2).
import type { Object3D } from 'three';
import type { Connection, State } from './strandcast.js';

export interface HairOptions {
  /** Draws the server's own head as well. Without, yours is expected where that is: the joint of the head in the origin, the
   *  face towards +Z, +Y up, metres. */
  head?: boolean;
  /** Moves and turns this object as the stream's head moves. Without, it stays where you put it, such as on an avatar's head. */
  followsPose?: boolean;
  /** What segments are: ribbons as wide as hair, or lines of a pixel, for half of the corners. Ribbons by default. */
  style?: 'ribbons' | 'lines';
  /** As for `connect`. */
  files?: string | URL;
}

/** Follows a connection's states. Hair is lit as the stream's look says; what is opaque in the scene hides what lies behind it. */
export class StrandcastHair extends Object3D {
  constructor(connection: Connection, options?: HairOptions);
  readonly connection: Connection;
  /** The state that is shown: some time behind the newest one, which a worker makes ready. */
  readonly state?: State;
  /** There is something that no picture has shown: for pages that draw only then. */
  readonly isDirty: boolean;
  /** What the newest picture took of the thread that draws, ms. */
  readonly drawMs: number;
  /** Leaves scene and connection, and frees what the graphics card holds. The connection stays open. */
  dispose(): void;
}
