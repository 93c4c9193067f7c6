// Numbers of a scene as the server tells it in a SceneText: protobuf text, in one line.
export type SceneNumbers = Map<string, number>;

/** By path, as "wind.mean_mps.x". What is no number is passed over; of what is repeated the last one stays. */
export function readScene(text: string): SceneNumbers {
  const numbers: SceneNumbers = new Map();
  const path: string[] = [];
  const token = /"(?:[^"\\]|\\.)*"|[{}]|[A-Za-z_][\w]*|[-+.\d][\w.+-]*|:/g;
  let name = '';
  let isValue = false;
  for (const [word] of text.matchAll(token) as Iterable<[string]>) {
    if (word === ':') isValue = true;
    else if (word === '{') {
      path.push(name);
      isValue = false;
    } else if (word === '}') path.pop();
    else if (isValue) {
      const value = Number(word);
      if (Number.isFinite(value)) numbers.set([...path, name].join('.'), value);
      isValue = false;
    } else name = word;
  }
  return numbers;
}

/** A solver's own parameters stand there as pairs of key and value. */
export function solverParameters(text: string): Map<string, number> {
  const all = new Map<string, number>();
  for (const [, key, value] of text.matchAll(/parameters\s*\{\s*key:\s*"([\w]+)"\s*value:\s*([-+.\dea]+)\s*\}/g))
    all.set(key!, Number(value));
  return all;
}
