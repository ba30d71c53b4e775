// Holds golden.py's bytes against npm's @foxglove/rosmsg2-serialization, which writes and reads CDR on its own.
//
// usage: npm install @foxglove/rosmsg@5.0.5 @foxglove/rosmsg2-serialization@3.1.0; node pons/wire/golden.mjs FILE
//        FILE: what golden.py --json wrote
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";

const require = createRequire(process.cwd() + "/");
const { parse } = require("@foxglove/rosmsg");
const { MessageReader, MessageWriter } = require("@foxglove/rosmsg2-serialization");

const { definitions, cases } = JSON.parse(readFileSync(process.argv[2], "utf8"));

// With all that it refers to. They look a type up by its package and name, whatever kind of file it is from.
const short = (name) => name.replace(/\/(msg|srv|action)\//, "/");
function all(name, seen = new Set()) {
  seen.add(name);
  for (const line of definitions[name].split("\n")) {
    const type = line.split(/[ [<]/)[0];
    if (type.includes("/") && !seen.has(type)) all(type, seen);
  }
  return seen;
}
function text(name) {
  const shortened = (of) => definitions[of].replace(/^\w+\/\w+\/\w+/gm, short);
  const others = [...all(name)].slice(1);
  return [shortened(name), ...others.map((of) => `${"=".repeat(80)}\nMSG: ${short(of)}\n${shortened(of)}`)].join("");
}

// 64-bit integers are BigInts there.
function value(name, from) {
  const made = {};
  for (const line of definitions[name].split("\n").filter(Boolean)) {
    const [type, field] = line.split(" ");
    const base = type.split(/[[<]/)[0];
    const one = (of) => (base.includes("/") ? value(base, of) : /^u?int64/.test(base) ? BigInt(of) : of);
    made[field] = Array.isArray(from[field]) ? from[field].map(one) : one(from[field]);
  }
  return made;
}

let wrong = 0;
for (const one of cases) {
  const parsed = parse(text(one.name), { ros2: true });
  const bytes = Buffer.from(new MessageWriter(parsed).writeMessage(value(one.name, one.value))).toString("hex");
  if (bytes !== one.bytes) {
    ++wrong;
    console.log(`${one.name}\n  rosbags  ${one.bytes}\n  foxglove ${bytes}`);
  }
  new MessageReader(parsed).readMessage(Buffer.from(one.bytes, "hex"));
}
console.log(`${cases.length} types, ${wrong} of other bytes`);
process.exit(wrong ? 1 : 0);
