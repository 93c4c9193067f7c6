// What a newcomer changes first, as sliders on top of the panel: names, order, ranges, defaults and words come from the
// server's list of parameters (common/scene/hair_controls.h), so that page, window and command line say the same.
import type { ParameterMessage } from '../wire';
import { element } from './element';

const SET_MS = 100;
const HELD_MS = 1500; // so long what a person did is shown although the server has not said it yet
const STEPS = 50; // of a slider by keys
const LOG_RATIO = 10; // of a range, from which on its slider is logarithmic

/** Of the quality, from the least to do to the most. */
const QUALITIES = ['fast', 'auto', 'full'];

/** Where a value stands on its slider, and which value a place stands for; `step` goes on by keys. */
interface Scale {
  minimum: number;
  maximum: number;
  step: number;
  place(value: string): number;
  value(place: number): string;
}

function scaleOf(info: ParameterMessage): Scale {
  if (!info.has_range) {
    const place = (value: string): number => Math.max(0, QUALITIES.indexOf(value));
    return { minimum: 0, maximum: QUALITIES.length - 1, step: 1, place, value: (at) => QUALITIES[Math.round(at)]! };
  }
  const isLog = info.minimum > 0 && info.maximum / info.minimum >= LOG_RATIO;
  const to = isLog ? Math.log10 : (value: number): number => value;
  const from = isLog ? (at: number): number => 10 ** at : (at: number): number => at;
  return {
    minimum: to(info.minimum), maximum: to(info.maximum), step: (to(info.maximum) - to(info.minimum)) / STEPS,
    place: (value) => to(Number(value)), value: (at) => String(Number(from(at).toPrecision(3))),
  };
}

class Control {
  readonly row = element('div', '', 'control');
  private readonly input = element('input');
  private readonly output = element('output');
  private scale!: Scale;
  private info!: ParameterMessage;
  private timer = 0;
  private heldUntilMs = 0;

  constructor(info: ParameterMessage, private readonly set: (path: string, value: string) => void) {
    const name = info.path.split('.').pop()!;
    const id = `control-${name}`;
    const label = element('label', name[0]!.toUpperCase() + name.slice(1));
    label.htmlFor = this.input.id = id;
    this.output.htmlFor.add(id);
    this.input.type = 'range';
    this.input.addEventListener('input', () => this.changed());
    this.input.addEventListener('keydown', (event) => this.key(event));
    this.row.addEventListener('dblclick', () => this.put(this.scale.place(this.info.unset_value)));
    this.row.append(label, this.input, this.output);
    this.take(info);
  }
  /** From the server. */
  take(info: ParameterMessage): void {
    this.info = info;
    this.scale = scaleOf(info);
    this.input.min = String(this.scale.minimum);
    this.input.max = String(this.scale.maximum);
    this.input.step = info.has_range ? 'any' : '1';
    if (performance.now() < this.heldUntilMs) return;
    this.input.valueAsNumber = this.scale.place(info.value);
    this.tell(info.value);
  }
  /** `why` not, to who may not move it. */
  allow(why: string): void {
    this.input.disabled = why !== '';
    const { note, unset_value: usual, unit } = this.info;
    this.row.title = why || `${note}. Double click: ${usual} ${unit}`.trimEnd();
  }
  private key(event: KeyboardEvent): void {
    const sign = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1 }[event.key];
    if (!sign) return;
    event.preventDefault();
    // Whole steps from the default, so that keys find it again.
    const { place, step } = this.scale;
    const usual = place(this.info.unset_value);
    this.put(usual + step * (Math.round((this.input.valueAsNumber - usual) / step) + sign));
  }
  private put(place: number): void {
    if (this.input.disabled) return;
    this.input.valueAsNumber = place;
    this.changed();
  }
  private changed(): void {
    this.heldUntilMs = performance.now() + HELD_MS;
    this.tell(this.scale.value(this.input.valueAsNumber));
    if (this.timer) return;
    this.timer = window.setTimeout(() => {
      this.timer = 0;
      this.set(this.info.path, this.scale.value(this.input.valueAsNumber));
    }, SET_MS);
  }
  private tell(value: string): void {
    // What runs where the server chooses, and why, stands at the end of the note.
    const runs = value === 'auto' && value === this.info.value ? /; (\w+) runs(?:, as |$)/.exec(this.info.note)?.[1] : '';
    this.output.textContent = runs ? `auto: ${runs}` : this.info.has_range ? `${Number(Number(value).toPrecision(3))}` : value;
    this.input.setAttribute('aria-valuetext', `${this.output.textContent} ${this.info.unit}`.trimEnd());
    const rests = this.info.note.startsWith('rests: ');
    this.row.classList.toggle('rests', rests);
  }
}

export class Controls {
  private readonly all = new Map<string, Control>();
  private readonly reason = element('p', '', 'note');
  private readonly rows = element('div');
  private why = '';

  constructor(place: HTMLElement, private readonly set: (path: string, value: string) => void) {
    this.reason.id = 'control-reason';
    this.rows.id = 'controls';
    this.rows.setAttribute('role', 'group');
    this.rows.setAttribute('aria-label', 'Hair');
    place.append(this.rows, this.reason);
  }
  /** All of them, or those that have other values now. */
  show(parameters: readonly ParameterMessage[]): void {
    for (const info of parameters) {
      if (!info.is_live || (info.path !== 'quality' && !info.path.startsWith('hair.'))) continue;
      let control = this.all.get(info.path);
      if (control) {
        control.take(info);
      } else {
        control = new Control(info, this.set);
        this.all.set(info.path, control);
        this.rows.append(control.row);
      }
      control.allow(this.why);
    }
  }
  /** Why this session may not move them; empty where it may. */
  allow(why: string): void {
    this.why = this.reason.textContent = why;
    for (const control of this.all.values()) control.allow(why);
  }
}
