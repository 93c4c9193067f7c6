// Copies shader files for the page's bundle without what only their readers need: comments, indentation, empty lines.
//   node client/web/plain_texts.mjs TO_FOLDER FROM_FOLDER FILE...     files by their paths in FROM_FOLDER
import fs from 'node:fs';
import path from 'node:path';

const [to, from, ...files] = process.argv.slice(2);
if (!files.length) {
  console.error('usage: node plain_texts.mjs TO_FOLDER FROM_FOLDER FILE...');
  process.exit(2);
}
for (const file of files) {
  const text = fs.readFileSync(path.join(from, file), 'utf8').replace(/\/\*[^]*?\*\/|\/\/.*$/gm, '');
  const lines = text.split('\n').map((line) => line.trim()).filter((line) => line);
  const out = path.join(to, file);
  fs.mkdirSync(path.dirname(out), { recursive: true });
  fs.writeFileSync(out, lines.join('\n') + '\n');
}
