// Reads a recording with npm's @mcap/core, and each message by the schema that lies in the file with @foxglove/rosmsg and
// @foxglove/rosmsg2-serialization, which must give the same bytes again. Run by hand, where node is.
//
// usage: npm install @mcap/core@2.2.2 @mcap/support@1.1.0 @foxglove/rosmsg@5.0.5 @foxglove/rosmsg2-serialization@3.1.0
//        build/release/tests/recording/recording_peer write FILE zstd; node tests/recording/others.mjs FILE
import { open } from "node:fs/promises";
import { createRequire } from "node:module";

const require = createRequire(process.cwd() + "/");
const { McapIndexedReader } = require("@mcap/core");
const { loadDecompressHandlers } = require("@mcap/support");
const { parse } = require("@foxglove/rosmsg");
const { MessageReader, MessageWriter } = require("@foxglove/rosmsg2-serialization");

const file = await open(process.argv[2], "r");
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
  const definitions = parse(new TextDecoder().decode(schema.data), { ros2: true });
  // What has no fields is a byte that means nothing: of one at the top the reader wants to know nothing.
  const has_blank = definitions.length === 0 ||
    definitions.some((each) => each.definitions.every((field) => field.isConstant));
  if (has_blank) blank += 1;
  if (definitions.length === 0 || definitions[0].definitions.every((field) => field.isConstant)) continue;
  const value = new MessageReader(definitions).readMessage(message.data);
  const again = Buffer.from(new MessageWriter(definitions).writeMessage(value));
  const alike = has_blank ? again.length === message.data.length : Buffer.compare(again, Buffer.from(message.data)) === 0;
  if (alike) continue;
  differ += 1;
  console.log(`${schema.name}: ${Buffer.from(message.data).toString("hex")} ${again.toString("hex")}`);
}
let attachments = 0;
for await (const _ of reader.readAttachments()) attachments += 1;
console.log(`${messages} of ${reader.statistics.messageCount} messages, ${differ} differ, ${blank} with blank types, ${attachments} attachments`);
await file.close();
process.exit(differ === 0 && BigInt(messages) === reader.statistics.messageCount ? 0 : 1);
