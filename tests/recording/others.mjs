// Reads a recording with npm's @mcap/core, and each message by the schema that lies in the file with @foxglove/rosmsg and
// @foxglove/rosmsg2-serialization, which must give the same bytes again. npm_test.py runs it; or by hand, with what
// tools/setup --npm installs:
//
// usage: build/release/tests/recording/recording_peer write FILE zstd; node tests/recording/others.mjs .npm-check FILE
import { open } from "node:fs/promises";
import { createRequire } from "node:module";
import { resolve } from "node:path";

const require = createRequire(resolve(process.argv[2]) + "/");
const { McapIndexedReader } = require("@mcap/core");
const { loadDecompressHandlers } = require("@mcap/support");
const { parse } = require("@foxglove/rosmsg");
const { MessageReader, MessageWriter } = require("@foxglove/rosmsg2-serialization");

// The writer makes a text's length of its UTF-16 units and cuts what is longer in UTF-8. It is given one of as many bytes,
// with '?' for each that is not ASCII; those are not compared.
function plain(value) {
  if (typeof value === "string")
    return Array.from(new TextEncoder().encode(value), (each) => (each < 0x80 ? String.fromCharCode(each) : "?")).join("");
  if (Array.isArray(value)) return value.map(plain);
  if (value === null || typeof value !== "object" || ArrayBuffer.isView(value)) return value;
  return Object.fromEntries(Object.entries(value).map(([name, each]) => [name, plain(each)]));
}

function alike(again, data, has_blank) {
  if (again.length !== data.length) return false;
  return has_blank || again.equals(data) || data.every((each, i) => each === again[i] || (each >= 0x80 && again[i] === 0x3f));
}

// By the number of the schema.
const types = new Map();
function type_of(schema) {
  if (types.has(schema.id)) return types.get(schema.id);
  const definitions = parse(new TextDecoder().decode(schema.data), { ros2: true });
  const blank = (each) => each.definitions.every((field) => field.isConstant);
  // What has no fields is a byte that means nothing: of one at the top the reader wants to know nothing.
  const type = { has_blank: definitions.length === 0 || definitions.some(blank),
                 is_blank: definitions.length === 0 || blank(definitions[0]) };
  if (!type.is_blank) {
    type.reader = new MessageReader(definitions);
    type.writer = new MessageWriter(definitions);
  }
  types.set(schema.id, type);
  return type;
}

const file = await open(process.argv[3], "r");
const reader = await McapIndexedReader.Initialize({
  readable: {
    size: async () => BigInt((await file.stat()).size),
    read: async (at, size) => (await file.read(new Uint8Array(Number(size)), 0, Number(size), Number(at))).buffer,
  },
  decompressHandlers: await loadDecompressHandlers(),
});
let messages = 0, differ = 0, blank = 0;
for await (const message of reader.readMessages({ validateCrcs: true })) {
  messages += 1;
  const channel = reader.channelsById.get(message.channelId);
  const schema = reader.schemasById.get(channel.schemaId);
  const type = type_of(schema);
  if (type.has_blank) blank += 1;
  if (type.is_blank) continue;
  const data = Buffer.from(message.data);
  const again = Buffer.from(type.writer.writeMessage(plain(type.reader.readMessage(message.data))));
  if (alike(again, data, type.has_blank)) continue;
  differ += 1;
  console.log(`${schema.name}: ${data.toString("hex")} ${again.toString("hex")}`);
}
let attachments = 0;
for await (const _ of reader.readAttachments()) attachments += 1;
console.log(`${messages} of ${reader.statistics.messageCount} messages, ${differ} differ, ${blank} with blank types, ${attachments} attachments`);
await file.close();
process.exit(differ === 0 && BigInt(messages) === reader.statistics.messageCount ? 0 : 1);
