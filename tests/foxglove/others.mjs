// Looks at a run as Foxglove does: with npm's @foxglove/ws-protocol, each message by the schema of its channel with
// @foxglove/rosmsg and @foxglove/rosmsg2-serialization. npm_test.py runs it; or by hand, with what tools/setup --npm
// installs:
//
// usage: build/release/apps/pons run parcel_cell --realtime --foxglove &
//        node tests/foxglove/others.mjs .npm-check ws://127.0.0.1:8765
import { createRequire } from "node:module";
import { resolve } from "node:path";

const require = createRequire(resolve(process.argv[2]) + "/");
const { FoxgloveClient } = require("@foxglove/ws-protocol");
const { WebSocket } = require("ws");
const { parse } = require("@foxglove/rosmsg");
const { MessageReader } = require("@foxglove/rosmsg2-serialization");

const SECONDS = 10;
const client = new FoxgloveClient({ ws: new WebSocket(process.argv[3], [FoxgloveClient.SUPPORTED_SUBPROTOCOL]) });
const subscribed = new Map();
let time = 0n, failed = 0;
client.on("error", (error) => { console.log(`error: ${error.message}`); process.exit(1); });
client.on("status", (status) => console.log(`status ${status.level}: ${status.message}`));
client.on("serverInfo", (info) => console.log(`${info.name}: ${info.capabilities}, ${JSON.stringify(info.metadata)}`));
client.on("advertiseServices", (services) => {
  for (const each of services) console.log(`service ${each.name} ${each.type}`);
});
client.on("advertise", (channels) => {
  for (const channel of channels) {
    const definitions = parse(channel.schema, { ros2: true });
    subscribed.set(client.subscribe(channel.id),
      { topic: channel.topic, type: channel.schemaName, reader: new MessageReader(definitions), messages: 0 });
  }
});
client.on("time", (message) => (time = message.timestamp));
client.on("message", ({ subscriptionId, data }) => {
  const channel = subscribed.get(subscriptionId);
  channel.messages += 1;
  try {
    channel.last = channel.reader.readMessage(data);
  } catch (error) {
    failed += 1;
    console.log(`${channel.topic}: ${error.message}`);
  }
});
setTimeout(() => {
  for (const { topic, type, messages } of subscribed.values()) console.log(`${topic} ${type} ${messages}`);
  const states = [...subscribed.values()].find((each) => each.topic === "/joint_states");
  const description = [...subscribed.values()].find((each) => each.topic === "/robot_description");
  console.log(`run's time ${Number(time) / 1e9} s; ${failed} messages could not be read`);
  const seen = states?.last?.name?.length > 0 && description?.last?.data?.includes("<robot") && time > 0n;
  process.exit(seen && failed === 0 ? 0 : 1);
}, SECONDS * 1000);
