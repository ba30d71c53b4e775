#!/usr/bin/env python3
"""Recordings beside MCAP's own library of Python: it reads ours, every type's bytes by the schema that lies in the file,
and what Pons mended; Pons reads its.

usage: others_test.py RECORDING_PEER PONS     run by .venv-check's interpreter"""

import io
import re
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

from mcap.reader import NonSeekingReader, SeekingReader
from mcap.writer import CompressionType, IndexType, Writer
from mcap_ros2._dynamic import generate_dynamic, serialize_dynamic
from mcap_ros2.decoder import DecoderFactory

PEER, PONS = sys.argv[1:3]
COMPRESSIONS = ("none", "lz4", "zstd")
TYPES = 245
# Names of parts of services and actions that this library takes for none; others.mjs reads them.
NAMES_REFUSED = re.compile(r"_(Event|FeedbackMessage|(SendGoal|GetResult)_\w+)\b")
EMPTY = b"\0\1\0\0\0"


def run(*words, code=0):
    done = subprocess.run(list(map(str, words)), capture_output=True, text=True)
    assert done.returncode == code, f"{words}: {done.returncode}\n{done.stderr}"
    return done.stdout


def shown(path):
    """What Pons reads: (topic, sequence, log time, publish time, bytes)."""
    lines = [line.split(" ") for line in run(PEER, "show", path).splitlines()]
    return [(topic, int(number), int(log), int(published), bytes.fromhex(data)) for topic, number, log, published, data in lines]


def read(reader):
    return [(channel.topic, message.sequence, message.log_time, message.publish_time, message.data)
            for _, channel, message in reader.iter_messages()]


def seeking(data):
    return SeekingReader(io.BytesIO(data), validate_crcs=True, decoder_factories=[DecoderFactory()])


def blank(value):
    """Whether it has no field of any bytes."""
    return hasattr(value, "__slots__") and all(blank(getattr(value, name)) for name in value.__slots__)


class Others(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = Path(folder.name)

    def written(self, compression):
        path = self.root / f"{compression}.mcap"
        run(PEER, "write", path, compression)
        return path

    def test_what_pons_writes_is_read_through_its_summary_and_without(self):
        for compression in COMPRESSIONS:
            path = self.written(compression)
            data, expected = path.read_bytes(), shown(path)
            self.assertGreaterEqual(len(expected), TYPES)
            self.assertEqual(read(seeking(data)), expected)
            self.assertEqual(read(NonSeekingReader(io.BytesIO(data), validate_crcs=True)), expected)
            summary = seeking(data).get_summary()
            self.assertEqual(summary.statistics.message_count, len(expected))
            self.assertGreater(len(summary.chunk_indexes), 1)
            self.assertEqual([each.data for each in seeking(data).iter_attachments()], [b"what it was recorded for"])
            self.assertEqual([each.metadata for each in seeking(data).iter_metadata()], [{"world": "parcel_cell"}])
            header = seeking(data).get_header()
            self.assertEqual((header.profile, header.library), ("ros2", "pons"))

    def test_types_are_decoded_by_their_schemas_and_give_the_same_bytes_again(self):
        data, decoded = self.written("zstd").read_bytes(), 0
        for schema, _, message in seeking(data).iter_messages():
            with self.subTest(schema.name):
                self.assertEqual(schema.encoding, "ros2msg")
                text = schema.data.decode()
                if NAMES_REFUSED.search(f"{schema.name}\n{text}"):
                    continue
                value = generate_dynamic(schema.name, text)[schema.name](message.data)
                again = serialize_dynamic(schema.name, text)[schema.name](value)
                # The byte of what has no fields means nothing: it writes 0.
                self.assertEqual(again, EMPTY if blank(value) else message.data)
                decoded += 1
        self.assertGreaterEqual(decoded, 190)

    def test_a_run_is_read_and_its_messages_are_what_their_types_say(self):
        path = self.root / "run.mcap"
        run(PONS, "run", "small_cell", "--parcels", "1", "--quiet", "--record", path)
        data, expected = path.read_bytes(), shown(path)
        self.assertEqual(read(seeking(data)), expected)
        self.assertEqual(read(NonSeekingReader(io.BytesIO(data), validate_crcs=True)), expected)
        last = {channel.topic: value for _, channel, _, value in seeking(data).iter_decoded_messages()}
        self.assertEqual({channel.topic for _, channel, _ in seeking(data).iter_messages()}, set(last))
        self.assertEqual(len(last["/joint_states"].position), 7)
        self.assertIn("<robot", last["/robot_description"].data)
        self.assertEqual(last["/pons/beliefs"].header.frame_id, "world")
        self.assertGreater(last["/pons/state"].tick, 1000)
        notes = {each.name: each.metadata for each in seeking(data).iter_metadata()}
        self.assertEqual(notes["pons.run"]["world"], "small_cell")
        self.assertEqual(notes["pons.end"]["how"], "complete")

    def test_what_pons_mends_is_whole(self):
        whole = self.written("lz4").read_bytes()
        for part in (0.1, 0.35, 0.6, 0.8, 0.9):
            cut, mended = self.root / "cut.mcap", self.root / "mended.mcap"
            cut.write_bytes(whole[:int(len(whole) * part)])
            run(PONS, "recording", "check", cut, code=1)
            run(PONS, "recording", "repair", cut, "--output", mended, "--overwrite")
            messages = read(seeking(mended.read_bytes()))
            self.assertEqual(messages, shown(mended))
            self.assertEqual(messages, read(seeking(whole))[:len(messages)])
        self.assertGreater(len(messages), 100)

    def test_pons_reads_what_it_writes_and_finds_it_whole(self):
        variants = {"none": {"compression": CompressionType.NONE}, "lz4": {"compression": CompressionType.LZ4},
                    "zstd": {"compression": CompressionType.ZSTD}, "unchunked": {"use_chunking": False},
                    "unchecked": {"enable_crcs": False}, "data_crcs": {"enable_data_crcs": True},
                    "no_index": {"index_types": IndexType.NONE}, "no_statistics": {"use_statistics": False},
                    "no_summary": {"use_statistics": False, "use_summary_offsets": False, "repeat_channels": False,
                                   "repeat_schemas": False, "index_types": IndexType.NONE}}
        for name, options in variants.items():
            with self.subTest(name):
                path = self.root / f"{name}.mcap"
                with path.open("wb") as stream:
                    self.write(Writer(stream, chunk_size=1000, **options))
                self.assertEqual(shown(path), self.messages())
                self.assertIn("whole: 100 messages", run(PONS, "recording", "check", path))
                told = run(PONS, "recording", "info", path)
                self.assertIn(": finished", told)
                self.assertRegex(told, r"/text +std_msgs/msg/String +50 ")
                run(PONS, "recording", "export", path, "--csv", self.root / name)
                self.assertIn(b"\r\n0,0,0,0\r\n", (self.root / name / "text.csv").read_bytes())

    @staticmethod
    def messages():
        return [("/text" if i % 2 == 0 else "/json", i, i * 10, i * 9,
                 b"\0\1\0\0\2\0\0\0%d\0" % (i % 10) if i % 2 == 0 else b'{"i":%d}' % i) for i in range(100)]

    def write(self, writer):
        writer.start(profile="", library="another")
        schema = writer.register_schema("std_msgs/msg/String", "ros2msg", b"string data")
        text = writer.register_channel("/text", "cdr", schema)
        json = writer.register_channel("/json", "json", 0)
        writer.add_attachment(1, 2, "a.txt", "text/plain", b"abc")
        for topic, sequence, log_time, publish_time, data in self.messages():
            writer.add_message(text if topic == "/text" else json, log_time, data, publish_time, sequence)
        writer.add_metadata("m", {"a": "b"})
        writer.finish()


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
