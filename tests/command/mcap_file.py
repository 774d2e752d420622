#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Reads an .mcap by the text of its specification (https://mcap.dev/spec) with nothing of ours, and
compares it with what the hands did.

mcap_file.py FILE.mcap FRAMES.csv [HAND=FRAMES.csv ...]: FRAMES.csv of a run without names, or one
for each hand. Exit 1 where the file breaks a rule of its format or says something else.
"""
import csv
import math
import struct
import sys
import zlib
from pathlib import Path

MAGIC = b"\x89MCAP0\r\n"
HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX, CHUNK_INDEX = range(1, 9)
STATISTICS, METADATA, METADATA_INDEX, SUMMARY_OFFSET, DATA_END = 11, 12, 13, 14, 15


def require(is_right, what):
    if not is_right:
        sys.exit(f"mcap_file.py: {what}")


class Fields:
    """Numbers and texts of a record's content, one after the other."""

    def __init__(self, content):
        self.content, self.at = content, 0

    def take(self, size):
        require(self.at + size <= len(self.content), "a record is too short")
        self.at += size
        return self.content[self.at - size : self.at]

    def number(self, code):
        return struct.unpack("<" + code, self.take(struct.calcsize("<" + code)))[0]

    def text(self):
        return self.take(self.number("I")).decode("utf-8")

    def entries(self, key, value):
        inner, found = Fields(self.take(self.number("I"))), {}
        while inner.at < len(inner.content):
            one = key(inner)
            require(one not in found, "a key that is there twice")
            found[one] = value(inner)
        return found

    def texts(self):
        return self.entries(Fields.text, Fields.text)

    def rest(self):
        return self.take(len(self.content) - self.at)


def records(data, at, end):
    """(opcode, content, place of the record) of the records between two places."""
    while at < end:
        op, size = struct.unpack_from("<BQ", data, at)
        require(at + 9 + size <= end, f"a record at {at} goes beyond its part")
        yield op, data[at + 9 : at + 9 + size], at
        at += 9 + size


def record_at(data, at):
    op, size = struct.unpack_from("<BQ", data, at)
    return op, data[at + 9 : at + 9 + size], 9 + size


class Cdr:
    """OMG's common data representation, little-endian: numbers at multiples of their size."""

    def __init__(self, data):
        require(data[:4] == b"\0\1\0\0", "is no little-endian CDR")
        self.data, self.at = data[4:], 0

    def number(self, code):
        size = struct.calcsize("<" + code)
        self.at = (self.at + size - 1) // size * size
        self.at += size
        return struct.unpack_from("<" + code, self.data, self.at - size)[0]

    def text(self):
        size = self.number("I")
        self.at += size
        require(self.data[self.at - 1] == 0, "a text without its zero")
        return self.data[self.at - size : self.at - 1].decode("ascii")


PRIMITIVES = {"float64": "d", "int32": "i", "uint32": "I"}


def types_of(name, definition):
    """The types of a ros2msg schema: their names and their fields."""
    parts = definition.split("=" * 80 + "\nMSG: ")
    types = {None: parts[0]}
    for part in parts[1:]:
        head, _, body = part.partition("\n")
        types[head] = body
    types = {key: [line.split() for line in body.splitlines()] for key, body in types.items()}
    used = {None}
    for fields in types.values():
        used |= {kind.removesuffix("[]") for kind, _ in fields} - {"string"} - set(PRIMITIVES)
    require(used == set(types), f"{name}: the types {set(types)} define, {used} are used")
    return types


def decoded(cdr, types, kind=None):
    """A message as its own schema says, as dictionaries."""
    message = {}
    for field, name in types[kind]:
        one = field.removesuffix("[]")
        count = cdr.number("I") if field != one else None
        read = []
        for _ in range(1 if count is None else count):
            if one == "string":
                read.append(cdr.text())
            elif one in PRIMITIVES:
                read.append(cdr.number(PRIMITIVES[one]))
            else:
                read.append(decoded(cdr, types, one))
        message[name] = read if count is not None else read[0]
    return message


class Mcap:
    """A file that was read from its beginning, with all that its summary says checked against it."""

    def __init__(self, data):
        require(data.startswith(MAGIC) and data.endswith(MAGIC), "magic")
        self.data = data
        self.schemas, self.channels, self.messages, self.metadata = {}, {}, [], {}
        self.chunks, self.last_time, self.counts = [], 0, {}
        begin = list(records(data[: -len(MAGIC)], len(MAGIC), len(data) - len(MAGIC)))
        require(begin[0][0] == HEADER and begin[-1][0] == FOOTER, "begins or ends otherwise")
        header = Fields(begin[0][1])
        self.profile, self.library = header.text(), header.text()
        ends = [n for n, one in enumerate(begin) if one[0] == DATA_END]
        require(len(ends) == 1, "one end of the data")
        self.read_data(begin[1 : ends[0]])
        end_at = begin[ends[0]][2]
        crc = Fields(begin[ends[0]][1]).number("I")
        require(crc == zlib.crc32(data[:end_at]), "checksum of the data")
        self.check_summary(begin[ends[0] + 1 : -1], begin[-1])

    def define(self, op, content):
        fields = Fields(content)
        number = fields.number("H")
        if op == SCHEMA:
            require(number != 0, "a schema of number 0")
            self.schemas[number] = (fields.text(), fields.text(), fields.text())
        else:
            schema = fields.number("H")
            require(schema in self.schemas, "a channel before its schema")
            self.channels[number] = (schema, fields.text(), fields.text(), fields.texts())

    def read_data(self, all_records):
        expected = []
        for op, content, at in all_records:
            if op != MESSAGE_INDEX:
                require(not expected, "a chunk without an index of each of its channels")
            if op in (SCHEMA, CHANNEL):
                self.define(op, content)
            elif op == METADATA:
                fields = Fields(content)
                name = fields.text()
                self.metadata[name] = (fields.texts(), at, 9 + len(content))
            elif op == CHUNK:
                expected = self.read_chunk(content, at)
            elif op == MESSAGE_INDEX:
                fields = Fields(content)
                channel = fields.number("H")
                index, inner = [], Fields(fields.take(fields.number("I")))
                while inner.at < len(inner.content):
                    index.append((inner.number("Q"), inner.number("Q")))
                require((channel, index) in expected, "an index that is not that of the chunk")
                expected.remove((channel, index))
                self.chunks[-1]["indices"][channel] = at
                self.chunks[-1]["index_bytes"] += 9 + len(content)
            else:
                require(False, f"record {op} among the data")
        require(not expected, "a chunk without an index of each of its channels")

    def read_chunk(self, content, at):
        fields = Fields(content)
        first, last, size, crc = (fields.number(code) for code in "QQQI")
        require(fields.text() == "", "compressed")
        inner = fields.take(fields.number("Q"))
        require(len(inner) == size and zlib.crc32(inner) == crc, "size or checksum of a chunk")
        places, times = {}, []
        for op, message, place in records(inner, 0, len(inner)):
            require(op == MESSAGE, f"record {op} in a chunk")
            one = Fields(message)
            channel, count, logged, published = (one.number(code) for code in "HIQQ")
            require(channel in self.channels, "a message before its channel")
            require(logged >= self.last_time, "time goes back")
            require(published == logged, "published when it was not recorded")
            self.last_time = logged
            require(count == self.counts.get(channel, 0), "a message is missing")
            self.counts[channel] = count + 1
            places.setdefault(channel, []).append((logged, place))
            times.append(logged)
            self.messages.append((channel, logged, one.rest()))
        require(times and (first, last) == (min(times), max(times)), "times of a chunk")
        self.chunks.append({"at": at, "bytes": 9 + len(content), "times": (first, last),
                            "size": size, "indices": {}, "index_bytes": 0})
        return list(places.items())

    def check_summary(self, summary, footer):
        fields = Fields(footer[1])
        start, offsets_start, crc = fields.number("Q"), fields.number("Q"), fields.number("I")
        require(crc == zlib.crc32(self.data[start : footer[2] + 9 + 16]), "checksum of the summary")
        require(summary[0][2] == start, "where the summary begins")
        groups, offsets = [], []
        for op, content, at in summary:
            if op == SUMMARY_OFFSET:
                require(at >= offsets_start, "offsets among the summary")
                one = Fields(content)
                offsets.append((one.number("B"), one.number("Q"), one.number("Q")))
                continue
            if not groups or groups[-1][0] != op:
                groups.append([op, at, 0, []])
            groups[-1][2] += 9 + len(content)
            groups[-1][3].append(content)
        require([tuple(group[:3]) for group in groups] == offsets, "offsets of the summary")
        by_op = {group[0]: group[3] for group in groups}
        require(len(by_op) == len(groups), "records of a kind in two groups")
        twin = Mcap.__new__(Mcap)
        twin.schemas, twin.channels = {}, {}
        for op in (SCHEMA, CHANNEL):
            for content in by_op[op]:
                twin.define(op, content)
        require((twin.schemas, twin.channels) == (self.schemas, self.channels),
                "other schemas or channels in the summary")
        self.check_chunk_indices(by_op[CHUNK_INDEX])
        self.check_statistics(by_op[STATISTICS])
        named = {}
        for content in by_op[METADATA_INDEX]:
            one = Fields(content)
            at, size = one.number("Q"), one.number("Q")
            named[one.text()] = (at, size)
            require(record_at(self.data, at)[::2] == (METADATA, size), "where metadata are")
        require(named == {name: one[1:] for name, one in self.metadata.items()}, "metadata index")

    def check_chunk_indices(self, contents):
        require(len(contents) == len(self.chunks), "an index of each chunk")
        for content, chunk in zip(contents, self.chunks):
            one = Fields(content)
            times = (one.number("Q"), one.number("Q"))
            at, size = one.number("Q"), one.number("Q")
            indices = one.entries(lambda f: f.number("H"), lambda f: f.number("Q"))
            index_bytes, compression = one.number("Q"), one.text()
            sizes = (one.number("Q"), one.number("Q"))
            require((times, at, size, indices, index_bytes, compression, sizes)
                    == (chunk["times"], chunk["at"], chunk["bytes"], chunk["indices"],
                        chunk["index_bytes"], "", (chunk["size"],) * 2), "the index of a chunk")

    def check_statistics(self, contents):
        one = Fields(contents[0])
        counts = [one.number(code) for code in "QHIIII"]
        times = (one.number("Q"), one.number("Q"))
        by_channel = one.entries(lambda f: f.number("H"), lambda f: f.number("Q"))
        require(counts == [len(self.messages), len(self.schemas), len(self.channels), 0,
                           len(self.metadata), len(self.chunks)], f"statistics: {counts}")
        every = [message[1] for message in self.messages]
        require(times == (min(every), max(every)), "times of the statistics")
        found = dict.fromkeys(self.channels, 0)
        for channel, _, _ in self.messages:
            found[channel] += 1
        require(by_channel == found, "messages of each channel")

    def topics(self):
        """Time (ns), type and decoded message of each message, by topic."""
        types = {number: types_of(*schema[::2]) for number, schema in self.schemas.items()}
        found = {channel[1]: [] for channel in self.channels.values()}
        for number, time_ns, content in self.messages:
            schema, topic, encoding, metadata = self.channels[number]
            require(encoding == "cdr" and self.schemas[schema][1] == "ros2msg", "not as ROS 2 has it")
            require("offered_qos_profiles" in metadata, "required by the profile ros2")
            cdr = Cdr(content)
            message = decoded(cdr, types[schema])
            require(cdr.at == len(cdr.data), f"{topic}: bytes that are nothing")
            found[topic].append((time_ns, self.schemas[schema][0], message))
        return found


def xyz(vector):
    return [vector[axis] for axis in "xyz"]


def compare(topics, folder, file):
    """The topics of a hand are its frames.csv, number for number."""
    with open(file, newline="", encoding="utf-8") as opened:
        rows = list(csv.DictReader(opened))
    for name, unit, kind in (("probe", "m", "PoseStamped"), ("proxy", "m", "PoseStamped"),
                             ("force", "n", "WrenchStamped")):
        said = topics[f"{folder}/{name}"]
        require(len(said) == len(rows), f"{name}: {len(said)} messages of {len(rows)} frames")
        shift = 0.0
        for n, ((time_ns, its_kind, message), row) in enumerate(zip(said, rows)):
            require(its_kind == f"geometry_msgs/msg/{kind}", "another type")
            header = message["header"]
            require(header["frame_id"] == "patient_lps", "another frame")
            stamp = header["stamp"]
            require(stamp["sec"] * 10**9 + stamp["nanosec"] == time_ns, "another time")
            if row["trial"] == rows[0]["trial"]:
                require(abs(1e-9 * time_ns - float(row["time_s"])) <= 1e-9, f"{name}: time of {n}")
            elif n and row["trial"] != rows[n - 1]["trial"]:
                shift = 1e-9 * said[n - 1][0] + 1e-3 - float(row["time_s"])
            if shift:
                require(abs(1e-9 * time_ns - float(row["time_s"]) - shift) <= 2e-9, "a new trial")
            place = message["wrench"]["force"] if name == "force" else message["pose"]["position"]
            require(xyz(place) == [float(row[f"{name}_{axis}_{unit}"]) for axis in "xyz"],
                    f"{name} at {row['time_s']} s")
            if name == "force":
                require(xyz(message["wrench"]["torque"]) == [0.0] * 3, "a torque")
            else:
                turn = message["pose"]["orientation"]
                require(abs(math.hypot(*xyz(turn), turn["w"]) - 1.0) < 1e-9, "no rotation")
    return len(rows)


def check_frames(mcap, topics):
    """LPS goes to REP 103 by the one transform: x to the left becomes y, y to the back -x."""
    words = mcap.metadata["patient_from_patient_lps"][0]
    (_, _, message), = topics["/tf_static"]
    transform, = message["transforms"]
    require((words["parent"], words["child"]) == ("patient", "patient_lps")
            == (transform["header"]["frame_id"], transform["child_frame_id"]), "names of frames")
    require(xyz(transform["transform"]["translation"]) == [0.0] * 3, "a shift")
    turn = transform["transform"]["rotation"]
    x, y, z, w = *xyz(turn), turn["w"]
    require([float(one) for one in words["rotation_xyzw"].split()] == [x, y, z, w], "two rotations")
    matrix = [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
              [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
              [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]
    rows = [[float(one) for one in row.split()] for row in words["matrix"].split(";")]
    for row, expected in zip(matrix, ([0, -1, 0], [1, 0, 0], [0, 0, 1])):
        require(all(abs(a - b) < 1e-15 for a, b in zip(row, expected)), f"a rotation {matrix}")
    require(rows == [[0, -1, 0, 0], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]], "a matrix")
    qos = [channel[3]["offered_qos_profiles"] for channel in mcap.channels.values()
           if channel[1] == "/tf_static"]
    require("durability: 1" in qos[0] and "reliability: 1" in qos[0], "is not kept for latecomers")


def main(file, hands):
    mcap = Mcap(Path(file).read_bytes())
    require(mcap.profile == "ros2" and mcap.library.startswith("palpate "), "profile or library")
    topics = mcap.topics()
    check_frames(mcap, topics)
    expected = {"/tf_static"}
    for hand in hands:
        name, _, frames = hand.rpartition("=")
        folder = "/palpate" + (f"/{name}" if name else "")
        count = compare(topics, folder, frames)
        expected |= {f"{folder}/{one}" for one in ("probe", "proxy", "force")}
        print(f"{folder}: {count} frames are the same")
    require(set(topics) == expected, f"other topics: {sorted(topics)}")
    print(f"{len(mcap.messages)} messages in {len(mcap.chunks)} chunks")


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2:])
