// Look and parameters: on top what a newcomer changes first (controls.ts), below More a slider for each field with its range
// and unit, and hair colours by name.
import { Field, hairColors, lookSections, Section, simulationSections } from '../fields';
import { readScene, solverParameters } from '../scene_text';
import type { LookMessage, ParameterMessage } from '../wire';
import { Controls } from './controls';
import { element } from './element';

export interface PanelActions {
  /** "path=value" for the server, or for this window alone. */
  set(path: string, value: string): void;
  askScene(): void;
  askControls(): void;
  close(): void;
}

/** So many digits that a step of the slider is seen. */
function shownNumber(value: number): string {
  if (value === 0) return '0';
  const size = Math.abs(value);
  return size >= 100 ? value.toFixed(0) : size >= 0.01 ? String(Number(value.toPrecision(3))) : value.toExponential(1);
}
const withUnit = (value: number, unit: string): string => {
  if (unit === 'm' && Math.abs(value) < 0.1) return `${shownNumber(value * 1000)} mm`;
  return unit ? `${shownNumber(value)} ${unit}` : shownNumber(value);
};

const SET_MS = 100;

class Slider {
  readonly row = element('div', '', 'field');
  private readonly input = element('input');
  private readonly output = element('output');
  private timer = 0;
  private heldUntilMs = 0;
  constructor(private readonly field: Field, private readonly set: (value: string) => void) {
    const id = `field-${field.path.replace(/\W/g, '-')}`;
    const label = element('label', field.title);
    label.htmlFor = id;
    const most = Math.min(field.handy ?? field.maximum, field.maximum);
    const least = field.minimum < 0 && field.handy ? Math.max(-field.handy, field.minimum) : field.minimum;
    this.input.id = id;
    this.input.type = 'range';
    this.input.min = String(least);
    this.input.max = String(most);
    this.input.step = field.isWhole ? '1' : 'any';
    this.output.htmlFor.add(id);
    this.input.addEventListener('input', () => this.changed());
    // Any step is a small one to the arrow keys.
    this.input.addEventListener('keydown', (event) => {
      if (field.isWhole || !event.key.startsWith('Arrow')) return;
      event.preventDefault();
      const sign = event.key === 'ArrowRight' || event.key === 'ArrowUp' ? 1 : -1;
      this.input.valueAsNumber += (sign * (most - least)) / 50;
      this.changed();
    });
    const range = element('div', '', 'range');
    range.append(element('span', withUnit(least, field.unit)), element('span', withUnit(most, field.unit)));
    this.row.append(label, this.output, this.input, range);
  }
  private changed(): void {
    this.heldUntilMs = performance.now() + 1500;
    this.tell(this.input.valueAsNumber);
    if (this.timer) return;
    this.timer = window.setTimeout(() => {
      this.timer = 0;
      this.set(String(Number(this.input.valueAsNumber.toPrecision(5))));
    }, SET_MS);
  }
  private tell(value: number): void {
    const text = withUnit(value, this.field.unit);
    this.output.textContent = text;
    this.input.setAttribute('aria-valuetext', text);
  }
  show(value: number | undefined): void {
    this.row.hidden = value === undefined;
    if (value === undefined || performance.now() < this.heldUntilMs) return;
    this.input.value = String(value);
    this.tell(value);
  }
}

function lookNumber(look: LookMessage, path: string): number | undefined {
  let value: unknown = { look };
  for (const name of path.split('.')) value = (value as { [name: string]: unknown } | undefined)?.[name];
  return typeof value === 'number' ? value : undefined;
}

export class Panel {
  private readonly sliders = new Map<string, Slider>();
  private readonly colors = new Map<string, HTMLButtonElement>();
  private readonly note = element('p', '', 'note');
  private readonly simulation = element('div');
  private readonly controls: Controls;
  private readonly solver = element('div');
  private solverKeys = '';
  isOpen = false;

  constructor(private readonly place: HTMLElement, private readonly actions: PanelActions) {
    const header = element('header');
    const close = element('button', 'Close', 'small');
    close.addEventListener('click', () => actions.close());
    header.append(element('h2', 'Look and parameters'), close);
    const swatches = element('div', '', 'swatches');
    swatches.setAttribute('role', 'group');
    swatches.setAttribute('aria-label', 'Hair colour');
    for (const [name, root, tip] of hairColors) {
      const button = element('button');
      const swatch = element('span', '', 'swatch');
      swatch.style.background = `linear-gradient(${root}, ${tip})`;
      button.append(swatch, name);
      button.addEventListener('click', () => actions.set('look.hair_color', name));
      this.colors.set(name, button);
      swatches.append(button);
    }
    place.append(header);
    this.controls = new Controls(place, (path, value) => actions.set(path, value));
    const more = element('details', '', 'more');
    more.append(element('summary', 'More'), this.note, swatches);
    place.append(more);
    for (const section of lookSections) more.append(this.section(section, section.title === 'Colour'));
    for (const section of simulationSections) this.simulation.append(this.section(section, false));
    const own = element('details');
    own.append(element('summary', 'Strand model'), this.solver);
    this.simulation.append(own);
    more.append(this.simulation);
  }
  private section(section: Section, isOpen: boolean): HTMLElement {
    const details = element('details');
    details.open = isOpen;
    details.append(element('summary', section.title));
    for (const field of section.fields) {
      const slider = new Slider(field, (value) => this.actions.set(field.path, value));
      this.sliders.set(field.path, slider);
      details.append(slider.row);
    }
    return details;
  }

  toggle(): void {
    this.isOpen = !this.isOpen;
    this.place.hidden = !this.isOpen;
    if (this.isOpen) this.ask();
  }
  /** What it shows, of a session that has begun. */
  ask(): void {
    this.actions.askScene();
    this.actions.askControls();
  }
  setRole(isController: boolean, isStrands: boolean): void {
    this.simulation.hidden = !isController;
    this.controls.allow(isController ? '' : 'Who watches cannot move these: the server gave this page no right to steer.');
    this.note.textContent = isController
      ? 'You may steer: what you change here, everybody who watches sees.'
      : isStrands
        ? 'You watch: what you change here is seen in this window alone.'
        : 'You watch: the look of the server’s pictures is the server’s.';
  }
  showLook(look: LookMessage): void {
    for (const section of lookSections)
      for (const field of section.fields) this.sliders.get(field.path)!.show(lookNumber(look, field.path));
    const isMelanin = look.hair_color === 'melanin';
    for (const path of ['look.eumelanin', 'look.pheomelanin']) if (!isMelanin) this.sliders.get(path)!.show(undefined);
    for (const [name, button] of this.colors) button.setAttribute('aria-pressed', String(look.hair_color === name));
  }
  showControls(parameters: readonly ParameterMessage[]): void {
    this.controls.show(parameters);
  }
  showScene(text: string): void {
    const numbers = readScene(text);
    for (const section of simulationSections)
      for (const field of section.fields) this.sliders.get(field.path)!.show(numbers.get(field.path));
    this.showSolver(solverParameters(text));
  }
  /** Parameters whose ranges only the server knows: it refuses what does not fit, and says why. */
  private showSolver(parameters: Map<string, number>): void {
    const keys = [...parameters.keys()].join(' ');
    if (keys !== this.solverKeys) {
      this.solverKeys = keys;
      this.solver.replaceChildren(element('p', 'The server says which values each may have.', 'note'));
      for (const name of parameters.keys()) {
        const row = element('div', '', 'field');
        const label = element('label', name.replace(/_/g, ' '));
        const input = element('input');
        input.type = 'number';
        input.step = 'any';
        label.htmlFor = input.id = `solver-${name}`;
        input.addEventListener('change', () => this.actions.set(`solver.parameters.${name}`, input.value));
        row.append(label, input);
        this.solver.append(row);
      }
    }
    for (const [name, value] of parameters) {
      const input = this.solver.querySelector<HTMLInputElement>(`#solver-${name}`);
      if (input && document.activeElement !== input) input.value = String(value);
    }
  }
}
