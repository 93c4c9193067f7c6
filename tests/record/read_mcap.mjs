// Reads a recording with a library of others: as a stream, or by its index. Every message is decoded by the schema that
// stands in the file. Prints what there is as JSON.
//   node read_mcap.mjs stream|index FILE
import { open, readFile } from "node:fs/promises";
import { McapIndexedReader, McapStreamReader } from "@mcap/core";
import { decompress } from "fzstd";
import protobuf from "protobufjs";
import descriptor from "protobufjs/ext/descriptor/index.js";

const decompressHandlers = { zstd: (data, size) => decompress(data, new Uint8Array(Number(size))) };

class Contents {
  schemas = new Map();
  channels = new Map();
  topics = {}; // items
  messages = {};
  ticks = [];
  frames = [];

  addSchema(schema) {
    if (schema.encoding !== "protobuf") throw new Error(`schema ${schema.name} has the encoding ${schema.encoding}`);
    const set = descriptor.FileDescriptorSet.decode(schema.data);
    const root = protobuf.Root.fromDescriptor(set);
    root.resolveAll();
    this.schemas.set(schema.id, root.lookupType(schema.name));
  }
  addMessage(message) {
    const channel = this.channels.get(message.channelId);
    const decoded = this.schemas.get(channel.schemaId).decode(message.data);
    const items = decoded.items ?? [decoded];
    // Every item of a message has its place.
    if (decoded.items && decoded.order_steps?.length !== items.length) throw new Error(`${channel.topic} lacks orders`);
    this.messages[channel.topic] = (this.messages[channel.topic] ?? 0) + 1;
    this.topics[channel.topic] = (this.topics[channel.topic] ?? 0) + items.length;
    if (channel.topic === "/states") this.ticks.push(...items.map((state) => Number(state.tick)));
    if (channel.topic === "/strands/keyframes") this.frames.push(decoded.message[0]);
    if (channel.topic === "/strands/deltas") this.frames.push(...items.map((frame) => frame[0]));
  }
  add(record) {
    if (record.type === "Schema" && !this.schemas.has(record.id)) this.addSchema(record);
    if (record.type === "Channel") this.channels.set(record.id, record);
    if (record.type === "Message") this.addMessage(record);
  }
}

async function readStream(path) {
  const contents = new Contents();
  const reader = new McapStreamReader({ decompressHandlers, validateCrcs: true });
  reader.append(await readFile(path));
  for (let record; (record = reader.nextRecord()); ) contents.add(record);
  // A file that ends too early is no error for this reader.
  return { contents, isDone: reader.done(), bytesLeft: reader.bytesRemaining() };
}

async function readIndex(path) {
  const file = await open(path);
  const readable = {
    size: async () => BigInt((await file.stat()).size),
    read: async (offset, length) => {
      const buffer = new Uint8Array(Number(length));
      const { bytesRead } = await file.read(buffer, 0, buffer.length, Number(offset));
      if (bytesRead !== buffer.length) throw new Error(`${length} bytes at ${offset} are not there`);
      return buffer;
    },
  };
  const contents = new Contents();
  const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });
  for (const schema of reader.schemasById.values()) contents.addSchema(schema);
  contents.channels = reader.channelsById;
  let newest = 0n;
  for await (const message of reader.readMessages({ validateCrcs: true })) {
    if (message.logTime < newest) throw new Error("messages are not in the order of their time");
    newest = message.logTime;
    contents.addMessage(message);
  }
  await file.close();
  const counted = Object.fromEntries(
    [...reader.statistics.channelMessageCounts].map(([id, count]) => [reader.channelsById.get(id).topic, Number(count)]),
  );
  return { contents, counted, library: reader.header.library, profile: reader.header.profile };
}

const [way, path] = process.argv.slice(2);
const read = await (way === "stream" ? readStream(path) : readIndex(path));
const { contents, ...rest } = read;
const isOrdered = contents.ticks.every((tick, i) => i === 0 || tick >= contents.ticks[i - 1]);
console.log(
  JSON.stringify({ ...rest, topics: contents.topics, messages: contents.messages, states: contents.ticks.length, isOrdered, firstFrame: contents.frames[0], frames: contents.frames.length }),
);
