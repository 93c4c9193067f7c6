// Of a page that plays a recording: where it is, and whether it begins again at its end.
import type { TapePlace, ToTape } from '../tape';
import { element } from './element';

export class Timeline {
  readonly card = element('section', '', 'card');
  private readonly slider = element('input');
  private readonly text = element('output');
  private isHeld = false;
  place?: TapePlace;

  constructor(readonly send: (wish: ToTape) => void) {
    this.card.id = 'timeline';
    this.card.setAttribute('aria-label', 'Recording');
    this.slider.type = 'range';
    this.slider.setAttribute('aria-label', 'Time');
    this.slider.addEventListener('input', () => this.goTo(this.slider.valueAsNumber));
    this.slider.addEventListener('pointerdown', () => (this.isHeld = true));
    // Keys are the page's again.
    for (const kind of ['pointerup', 'pointercancel'] as const)
      this.slider.addEventListener(kind, () => {
        this.isHeld = false;
        this.slider.blur();
      });
    const loop = element('input');
    loop.type = 'checkbox';
    loop.checked = true;
    loop.addEventListener('change', () => {
      this.send({ kind: 'loop', isLooping: loop.checked });
      loop.blur();
    });
    const label = element('label');
    label.append(loop, ' Loop');
    this.card.append(this.slider, this.text, label);
  }
  show(place: TapePlace): void {
    this.place = place;
    this.slider.max = String(Math.max(1, Math.ceil(place.lengthMs)));
    if (!this.isHeld) this.slider.value = String(place.timeMs);
    this.text.textContent = `${(place.timeMs / 1000).toFixed(1)} / ${(place.lengthMs / 1000).toFixed(1)} s`;
    this.slider.setAttribute('aria-valuetext', this.text.textContent);
  }
  private goTo(timeMs: number): void {
    this.send({ kind: 'seek', timeMs });
  }
  /** Whether the key is one of its own. */
  key(key: string): boolean {
    const { timeMs, lengthMs } = this.place ?? { timeMs: 0, lengthMs: 0 };
    const to = { Home: 0, End: lengthMs, ',': timeMs - 1000, '.': timeMs + 1000 }[key];
    if (to === undefined) return false;
    this.goTo(Math.min(Math.max(to, 0), lengthMs));
    return true;
  }
}
