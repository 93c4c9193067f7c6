// Makes the page's files what programs have of them (common/page/page_files.h): names with a hash of the content where the
// browser may keep them for good, and everything compressed besides.
//   node client/web/pack_page.mjs OUT.cpp INDEX.html STYLE.css SCRIPT.js FIRST.wasm STEP.wasm WHOLE.wasm
// Of the index, @ASSETS@ becomes {"core", "stepCore", "wholeCore"} with the names of the modules, as JSON in an attribute, and
// the names of the style, the script and the module that the page begins with become theirs. Prints what each file takes.
import crypto from 'node:crypto';
import fs from 'node:fs';
import path from 'node:path';
import zlib from 'node:zlib';

const HASH_DIGITS = 12;
const LINE_BYTES = 96;
const MEDIA_TYPES = {
  '.html': 'text/html; charset=utf-8',
  '.css': 'text/css; charset=utf-8',
  '.js': 'text/javascript; charset=utf-8',
  '.wasm': 'application/wasm',
};

const [out, index, style, script, first, step, whole] = process.argv.slice(2);
if (!whole) {
  console.error('usage: node pack_page.mjs OUT.cpp INDEX.html STYLE.css SCRIPT.js FIRST.wasm STEP.wasm WHOLE.wasm');
  process.exit(2);
}
const files = [];

const { BROTLI_PARAM_QUALITY, BROTLI_PARAM_LGWIN, BROTLI_PARAM_SIZE_HINT, BROTLI_MAX_QUALITY, BROTLI_MAX_WINDOW_BITS } = zlib.constants;
const brotli = (content) => zlib.brotliCompressSync(content, { params: {
  [BROTLI_PARAM_QUALITY]: BROTLI_MAX_QUALITY, [BROTLI_PARAM_LGWIN]: BROTLI_MAX_WINDOW_BITS, [BROTLI_PARAM_SIZE_HINT]: content.length,
} });

function add(filePath, content, name) {
  const version = crypto.createHash('sha256').update(content).digest('hex').slice(0, HASH_DIGITS);
  const { name: stem, ext } = path.parse(filePath);
  const file = { path: name ?? `/${stem}.${version}${ext}`, ext, version, content, isFixed: name !== undefined };
  file.gzip = zlib.gzipSync(content, { level: 9 });
  file.brotli = brotli(content);
  files.push(file);
  return file.path.slice(1);
}
const addHashed = (filePath) => add(filePath, fs.readFileSync(filePath));

const attribute = (text) => text.replaceAll('&', '&amp;').replaceAll('"', '&quot;').replaceAll('<', '&lt;');
function replaceOnce(text, what, by) {
  if (text.split(what).length !== 2) throw new Error(`${index}: needs ${what} once`);
  return text.replace(what, () => by);
}

const assets = { core: addHashed(first), stepCore: addHashed(step), wholeCore: addHashed(whole) };
let page = fs.readFileSync(index, 'utf8');
page = replaceOnce(page, '@ASSETS@', attribute(JSON.stringify(assets)));
page = replaceOnce(page, 'src="main.js"', `src="${addHashed(script)}"`);
page = replaceOnce(page, 'href="strand_page.wasm"', `href="${assets.core}"`);
page = replaceOnce(page, 'href="style.css"', `href="${addHashed(style)}"`);
add(index, Buffer.from(page), '/');

/** A string literal: what is printed as it is, all else in octal, which has an end of its own. */
function literal(bytes) {
  const lines = [];
  for (let begin = 0; begin < bytes.length; begin += LINE_BYTES) {
    let line = '';
    for (const byte of bytes.subarray(begin, begin + LINE_BYTES)) {
      const isPlain = byte >= 0x20 && byte < 0x7f && !'"\\?'.includes(String.fromCharCode(byte));
      line += isPlain ? String.fromCharCode(byte) : '\\' + byte.toString(8).padStart(3, '0');
    }
    lines.push(`    "${line}"`);
  }
  return `std::string_view(\n${lines.join('\n') || '    ""'},\n    ${bytes.length})`;
}

const rows = files.map((file) => `    {"${file.path}", "${MEDIA_TYPES[file.ext]}", "${file.version}",
    PageFileName::${file.isFixed ? 'Fixed' : 'Hashed'},
    ${literal(file.content)},
    ${literal(file.gzip)},
    ${literal(file.brotli)}},
`);
fs.writeFileSync(out, `// Made by client/web/pack_page.mjs.
#include "common/page/page_files.h"

namespace strandcast {

PageFiles built_in_page() {
  static constexpr PageFile files[] = {
${rows.join('')}  };
  return files;
}

}  // namespace strandcast
`);
for (const file of files) console.log(`${file.path} ${file.content.length} bytes, ${file.gzip.length} by gzip, ${file.brotli.length} by Brotli`);
