// Holds golden.py's bytes against npm's: @foxglove/rosmsg2-serialization writes and reads each message by its definition,
// and field by field @foxglove/cdr alone writes it. golden_others.py runs it.
//
// usage: golden.mjs PACKAGES FILE     PACKAGES: where tools/setup --npm puts them; FILE: what golden.py --json wrote
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { resolve } from "node:path";

const [packages, file] = process.argv.slice(2);
const require = createRequire(resolve(packages) + "/");
const { CdrWriter } = require("@foxglove/cdr");
const { parse } = require("@foxglove/rosmsg");
const { MessageReader, MessageWriter } = require("@foxglove/rosmsg2-serialization");

const { definitions, cases } = JSON.parse(readFileSync(file, "utf8"));

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

// What each field is of, without what says how many there may be.
function fields(name) {
  return definitions[name].split("\n").filter(Boolean).map((line) => {
    const [type, field] = line.split(" ");
    return { field, base: type.split(/[[<]/)[0], is_array: /\[\d+\]/.test(type), is_sequence: /\[(<=\d+)?\]/.test(type) };
  });
}

// 64-bit integers are BigInts there.
function value(name, from) {
  const made = {};
  for (const { field, base } of fields(name)) {
    const one = (of) => (base.includes("/") ? value(base, of) : /^u?int64/.test(base) ? BigInt(of) : of);
    made[field] = Array.isArray(from[field]) ? from[field].map(one) : one(from[field]);
  }
  return made;
}

const OCTETS = { bool: "uint8", byte: "uint8", char: "uint8" };
function write(writer, name, from) {
  const all = fields(name);
  if (all.length === 0) writer.uint8(0);  // a struct of C has a member
  for (const { field, base, is_array, is_sequence } of all) {
    const one = (of) => {
      if (base.includes("/")) return write(writer, base, of);
      return writer[OCTETS[base] ?? base](base === "bool" ? Number(of) : of);
    };
    if (is_sequence) writer.sequenceLength(from[field].length);
    if (is_array || is_sequence) from[field].forEach(one);
    else one(from[field]);
  }
}

let wrong = 0;
function hold(one, by, data) {
  const bytes = Buffer.from(data).toString("hex");
  if (bytes === one.bytes) return;
  ++wrong;
  console.log(`${one.name}\n  golden ${one.bytes}\n  ${by} ${bytes}`);
}
for (const one of cases) {
  const parsed = parse(text(one.name), { ros2: true });
  const given = value(one.name, one.value);
  hold(one, "@foxglove/rosmsg2-serialization", new MessageWriter(parsed).writeMessage(given));
  new MessageReader(parsed).readMessage(Buffer.from(one.bytes, "hex"));
  const writer = new CdrWriter();
  write(writer, one.name, given);
  hold(one, "@foxglove/cdr", writer.data);
}
console.log(`${cases.length} types, ${wrong} of other bytes`);
process.exit(wrong ? 1 : 0);
