// Files that a person drops on the page: it says which program takes them, and stays.
const HAIR = /\.(tfx|hair|ply|usd[acz]?|abc)$/i;
const MOTION = /\.bvh$/i;

/** The command that takes a file; `isBundle`: this page is a file itself. */
export function wordsFor(name: string, isBundle: boolean): string {
  if (MOTION.test(name))
    return isBundle ? `${name} moves a head: strandcast-ctl bundle hair.html --motion ${name} makes a page that shows it.` : `${name} moves a head: strandcast-ctl feed --motion ${name} sends it to this server.`;
  if (HAIR.test(name))
    return isBundle ? `${name} is hair: strandcast-ctl bundle ${name} page.html makes a page that shows it.` : `${name} is hair: strandcast-server --groom ${name} serves it.`;
  return `${name} is neither hair nor motion.`;
}

export function followFiles(isBundle: boolean, say: (text: string) => void): void {
  const hasFiles = (event: DragEvent): boolean => event.dataTransfer?.types.includes('Files') ?? false;
  addEventListener('dragover', (event) => {
    if (hasFiles(event)) event.preventDefault(); // else the browser leaves the page for the file
  });
  addEventListener('drop', (event) => {
    if (!hasFiles(event)) return;
    event.preventDefault();
    const file = event.dataTransfer!.files[0];
    if (file) say(wordsFor(file.name, isBundle));
  });
}
