// Measurements: a line, and all of them behind it.
export type Row = readonly [string, string];

export class Hud {
  private isOpen = false;
  private readonly cells = new Map<string, HTMLElement>();
  constructor(private readonly line: HTMLButtonElement, private readonly table: HTMLElement) {
    line.addEventListener('click', () => this.toggle());
  }
  toggle(): void {
    this.isOpen = !this.isOpen;
    this.table.hidden = !this.isOpen;
    this.line.setAttribute('aria-expanded', String(this.isOpen));
  }
  show(line: string, rows: readonly Row[]): void {
    if (this.line.textContent !== line) this.line.textContent = line;
    if (!this.isOpen) return;
    const names = rows.map(([name]) => name);
    if (names.join('\n') !== [...this.cells.keys()].join('\n')) {
      this.table.replaceChildren();
      this.cells.clear();
      for (const name of names) {
        const title = document.createElement('dt');
        title.textContent = name;
        const value = document.createElement('dd');
        this.table.append(title, value);
        this.cells.set(name, value);
      }
    }
    for (const [name, text] of rows) {
      const cell = this.cells.get(name)!;
      if (cell.textContent !== text) cell.textContent = text;
    }
  }
}

/** Short sentences over the picture, for a while each. */
export class Warnings {
  constructor(private readonly place: HTMLElement, private readonly lasting: HTMLElement) {}
  say(text: string, isError = false): void {
    const line = document.createElement('p');
    line.textContent = text;
    line.className = isError ? 'error' : '';
    this.place.append(line);
    if (this.place.childElementCount > 5) this.place.firstElementChild?.remove();
    setTimeout(() => line.remove(), isError ? 9000 : 4500);
  }
  /** Stay as long as they are told; of long ones the beginning, until all measurements are shown. */
  keep(texts: readonly string[]): void {
    if ([...this.lasting.children].map((line) => line.textContent).join('\n') === texts.join('\n')) return;
    this.lasting.replaceChildren(...texts.map((text) => Object.assign(document.createElement('p'), { textContent: text })));
  }
}
