// Copies shader files for the page's bundle without what only their readers and C++ need: comments, indentation, spaces
// between signs, empty lines, parts for C++, and constants that none of the files uses.
//   node client/web/plain_texts.mjs TO_FOLDER FROM_FOLDER FILE...     files by their paths in FROM_FOLDER
import fs from 'node:fs';
import path from 'node:path';

const [to, from, ...files] = process.argv.slice(2);
if (!files.length) {
  console.error('usage: node plain_texts.mjs TO_FOLDER FROM_FOLDER FILE...');
  process.exit(2);
}

/** Not in what is for the preprocessor, where spaces tell what is defined; `a - -b` keeps its own. */
function dense(line) {
  if (line.startsWith('#')) return line;
  return line.replace(/ *([=*/<>!&|,;:?(){}[\]]) */g, '$1').replace(/([^+\- ]) ?([+-]) ?(?=[^+\- ])/g, '$1$2');
}

function plain(text) {
  const lines = text.replace(/\/\*[^]*?\*\/|\/\/.*$/gm, '').split('\n').map((line) => dense(line.trim())).filter((line) => line);
  let isForOthers = false;
  return lines.filter((line) => {
    const wasForOthers = isForOthers;
    if (line === '#ifdef __cplusplus') isForOthers = true;
    else if (isForOthers && line === '#endif') isForOthers = false;
    return !wasForOthers && !isForOthers;
  });
}

const texts = new Map(files.map((file) => [file, plain(fs.readFileSync(path.join(from, file), 'utf8'))]));
const uses = new Map();
for (const [name] of [...texts.values()].flat().join('\n').matchAll(/\bk[A-Z]\w*/g)) uses.set(name, (uses.get(name) ?? 0) + 1);
for (const [file, lines] of texts) {
  const used = lines.filter((line) => {
    const constant = /^const uint (k\w+)=\w+;$/.exec(line)?.[1];
    return constant === undefined || uses.get(constant) > 1;
  });
  const out = path.join(to, file);
  fs.mkdirSync(path.dirname(out), { recursive: true });
  fs.writeFileSync(out, used.join('\n') + '\n');
}
