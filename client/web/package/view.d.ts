// <strandcast-view src="wss://HOST:7878" token="..." head="..." codec="..." draw="gl|tiles" files="...">
import type { Connection } from './strandcast.js';

export interface StrandcastView extends HTMLElement {
  /** The stream that is shown; its states go to the drawing, not to listeners. */
  readonly connection?: Connection;
}
declare global {
  interface HTMLElementTagNameMap {
    'strandcast-view': StrandcastView;
  }
}
