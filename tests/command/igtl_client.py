# SPDX-License-Identifier: Apache-2.0
"""A client of OpenIGTLink, written from the field tables of its specification, with struct alone.

    igtl_client.py session PORT VERSION BATCHES OUT.json    a session, its transforms to OUT.json
    igtl_client.py compare FRAMES.csv IN.json ...           its transforms are frames that were recorded
    igtl_client.py faults PORT                              what no client should send
    igtl_client.py tool PORT NAME                           moves a tool, and looks where the probe goes

Exit status 1 and a line that says what was wrong, else 0.
"""
import csv
import json
import socket
import struct
import sys
import time

HEADER = struct.Struct(">H12s20sQQQ")
NAMES = ["Stylus", "StylusVelocity", "Buttons", "Force", "Proxy"]
PATIENCE_S = 60.0  # of a slow machine


def check(holds, what):
    if not holds:
        raise SystemExit("igtl_client.py: " + what)


def table_of_crc():
    table = []
    for byte in range(256):
        rest = byte << 56
        for _ in range(8):
            rest = (rest << 1 ^ 0x42F0E1EBA9EA3693) & 0xFFFFFFFFFFFFFFFF if rest >> 63 else rest << 1
        table.append(rest)
    return table


TABLE = table_of_crc()


def crc64(data):
    rest = 0
    for byte in data:
        rest = TABLE[rest >> 56 ^ byte] ^ rest << 8 & 0xFFFFFFFFFFFFFFFF
    return rest


class Message:
    """What came, taken apart by the field tables."""

    def __init__(self, header, body):
        self.version, kind, name, self.time, size, crc = header
        self.type = kind.rstrip(b"\0").decode()
        self.name = name.rstrip(b"\0").decode()
        self.id, self.metadata, self.content = None, {}, body
        # The largest are checked once in a while: this language takes a second for a megabyte.
        check(size > 200000 or crc64(body) == crc, self.type + ": the checksum is wrong")
        if self.version == 2:
            self.take_apart(body)

    def take_apart(self, body):
        extended, table, pairs, self.id = struct.unpack_from(">HHII", body)
        check(extended == 12, "the extended header has %d bytes" % extended)
        end = len(body) - table - pairs
        self.content = body[extended:end]
        (count,) = struct.unpack_from(">H", body, end)
        check(table == 2 + 8 * count, "the metadata's table has %d bytes" % table)
        at = end + table
        for i in range(count):
            key, _, value = struct.unpack_from(">HHI", body, end + 2 + 8 * i)
            self.metadata[body[at:at + key].decode()] = body[at + key:at + key + value].decode()
            at += key + value
        check(at == len(body), "the metadata do not fill the body")

    def seconds(self):
        return self.time / 2.0**32

    def matrix(self):
        """Columns: three of the rotation, the last one."""
        values = struct.unpack(">12f", self.content)
        return [values[3 * i:3 * i + 3] for i in range(4)]


class Client:
    def __init__(self, port, version):
        self.version = version
        self.socket = socket.create_connection(("127.0.0.1", port), PATIENCE_S)

    def close(self):
        self.socket.close()

    def bytes_of(self, kind, name=b"", content=b"", crc=None):
        body = content
        if self.version == 2:
            body = struct.pack(">HHII", 12, 2, 0, 7) + content + struct.pack(">H", 0)
        return HEADER.pack(self.version, kind, name, 0, len(body),
                           crc64(body) if crc is None else crc) + body

    def send(self, *message, **how):
        self.socket.sendall(self.bytes_of(*message, **how))

    def read(self, size):
        data = b""
        while len(data) < size:
            piece = self.socket.recv(min(size - len(data), 1 << 20))
            if not piece:
                raise ConnectionError("the server has closed the connection")
            data += piece
        return data

    def receive(self):
        header = HEADER.unpack(self.read(HEADER.size))
        return Message(header, self.read(header[4]))

    def wait_for(self, kind, name=None):
        """The next one of that type, and of that name."""
        until = time.monotonic() + PATIENCE_S
        while time.monotonic() < until:
            message = self.receive()
            if message.type == kind and name in (None, message.name):
                return message
        raise SystemExit("igtl_client.py: %s %s does not come" % (kind, name))

    def is_closed(self):
        """Waits for the server to close."""
        try:
            while True:
                self.receive()
        except ConnectionError:
            return True


def surface_of(message):
    """Points, triangles and the colour of a POLYDATA, by the field table."""
    data = message.content
    counts = struct.unpack_from(">10I", data)
    points, polygons, bytes_of_polygons = counts[0], counts[5], counts[6]
    check(counts[1:5] == (0, 0, 0, 0) and counts[7:] == (0, 0, 1), "POLYDATA: counts %r" % (counts,))
    check(bytes_of_polygons == 16 * polygons, "POLYDATA: polygons are no triangles")
    at = 40
    numbers = struct.unpack_from(">%df" % (3 * points), data, at)
    at += 12 * points
    cells = struct.unpack_from(">%dI" % (4 * polygons), data, at)
    at += bytes_of_polygons
    check(all(cells[4 * i] == 3 for i in range(polygons)), "POLYDATA: a polygon is no triangle")
    check(max(cells[i] for i in range(4 * polygons) if i % 4) < points, "POLYDATA: there is no such point")
    kind, components, tuples = struct.unpack_from(">BBI", data, at)
    check((kind, components, tuples) == (0x04, 4, points), "POLYDATA: no colour for each point")
    at += 6
    check(data[at:at + 6] == b"RGBA\0\0", "POLYDATA: the attribute is %r" % data[at:at + 6])
    at += 6
    colors = struct.unpack_from(">%df" % (4 * points), data, at)
    check(at + 16 * points == len(data), "POLYDATA: bytes are left")
    check(all(colors[i] == colors[i % 4] for i in range(4 * points)), "POLYDATA: several colours")
    corners = [(min(numbers[a::3]), max(numbers[a::3])) for a in range(3)]
    return {"name": message.name, "points": points, "triangles": polygons, "rgba": colors[:4],
            "box": corners, "raw": (numbers, cells)}


def session(port, version, batches, out):
    """Connects, takes STATUS, surfaces and so many batches; asks; leaves; comes again."""
    began_s = time.monotonic()
    client = Client(port, version)
    if version == 2:
        client.send(b"STATUS", b"Slicer", struct.pack(">HQ20s", 1, 0, b"") + b"\0")
    surfaces, status, found, stray = [], [], [], []
    while len(found) < batches * len(NAMES):
        message = client.receive()
        check(message.version == version, "%s has a header of version %d" % (message.type, message.version))
        if message.type == "TRANSFORM":
            found.append(message)
        elif message.type == "POLYDATA":
            surfaces.append(surface_of(message))
        elif message.type == "STATUS":
            status.append(message)
        else:
            stray.append(message.type)
    check(not stray, "what was not asked for: %r" % stray)
    check(len(status) == 1 and struct.unpack_from(">H", status[0].content)[0] == 1, "no STATUS that is ok")
    check(surfaces, "no surface came")
    check_batches(found, version, time.monotonic() - began_s)
    check_queries(client, version, surfaces)
    client.close()
    again = Client(port, version)
    again.send(b"GET_STATUS", b"x")
    check(again.wait_for("STATUS", "x"), "no answer after a new connection")
    again.close()
    rows = [{"id": m.id, "name": m.name, "last": m.matrix()[3]} for m in found]
    for surface in surfaces:
        del surface["raw"]
    with open(out, "w") as file:
        json.dump({"version": version, "surfaces": surfaces, "transforms": rows}, file)
    print("version %d: %d transforms, surfaces %r" % (version, len(found), surfaces))


def check_batches(found, version, took_s):
    for i in range(0, len(found), len(NAMES)):
        batch = found[i:i + len(NAMES)]
        check([m.name for m in batch] == NAMES, "a batch is %r" % [m.name for m in batch])
        check(len({m.time for m in batch}) == 1, "a batch has several times")
        if version == 2:
            check(len({m.id for m in batch}) == 1, "a batch has several frames")
            check([m.metadata["unit"] for m in batch] == ["mm", "mm/s", "1", "N", "mm"], "units")
    times = [m.seconds() for m in found[::len(NAMES)]]
    check(all(a < b for a, b in zip(times, times[1:])), "batches are not in order")
    # The first one may have waited for this program, which was busy with the surfaces.
    check(len(times) - 2 <= 60.0 * took_s, "%d batches in %g s" % (len(times), took_s))
    check(abs(times[-1] - time.time()) < PATIENCE_S, "the times are not the clock's")


def check_queries(client, version, surfaces):
    client.send(b"GET_POLYDATA")
    for surface in surfaces:
        again = surface_of(client.wait_for("POLYDATA"))
        check(again == surface, "the surface is another one when it is asked for")
    client.send(b"GET_POLYDATA", b"no such")
    check(client.wait_for("POLYDATA", "no such").content == b"", "a surface that there is not")
    client.send(b"GET_TRANS", b"no such")
    check(client.wait_for("TRANSFORM", "no such").content == b"", "a transform that there is not")
    client.send(b"GET_CAPABIL")
    check(client.wait_for("CAPABILITY").content == struct.pack(">12s12s12s", b"TRANSFORM", b"POLYDATA", b"STATUS"),
          "capabilities")
    client.send(b"STT_TDATA", b"Tracker", struct.pack(">I32s", 50, b"RAS"))
    check(client.wait_for("RTS_TDATA", "Tracker").content == b"\1", "STT_TDATA is not refused")
    # What nobody here reads is passed over by its size.
    client.send(b"IMAGE", b"CT", b"\x55" * 300000)
    client.send(b"STRING", b"note", struct.pack(">HH", 3, 2) + b"hi")
    client.send(b"GET_STATUS", b"alive")
    check(client.wait_for("STATUS", "alive").version == version, "no answer after what is unknown")


def compare(frames_csv, files):
    """Each transform is a frame of the recording, exactly: RAS, mm, as floats."""
    with open(frames_csv, newline="") as file:
        rows = list(csv.DictReader(file))

    def column(row, what, unit, factor):
        x, y, z = (factor * float(row["%s_%s_%s" % (what, axis, unit)]) for axis in "xyz")
        return struct.pack(">3f", 0.0 - x, 0.0 - y, z)

    by_frame = {int(row["frame"]) & 0xFFFFFFFF: row for row in rows}
    by_probe = {}
    for row in rows:
        by_probe.setdefault(column(row, "probe", "m", 1e3), []).append(row)
    compared = 0
    for name in files:
        with open(name) as file:
            recorded = json.load(file)
        transforms = recorded["transforms"]
        for i in range(0, len(transforms), len(NAMES)):
            stylus, _, _, force, proxy = transforms[i:i + len(NAMES)]
            sent = [struct.pack(">3f", *t["last"]) for t in (stylus, proxy, force)]
            likely = [by_frame[stylus["id"]]] if recorded["version"] == 2 else by_probe.get(sent[0], [])
            wanted = [[column(row, "probe", "m", 1e3), column(row, "proxy", "m", 1e3), column(row, "force", "n", 1.0)]
                      for row in likely]
            check(sent in wanted, "%s, batch %d: %r is no frame of the recording" % (name, i // 5, transforms[i:i + 5]))
            compared += 1
    print("%d batches are frames of %s" % (compared, frames_csv))


def faults(port):
    """What is wrong is left out or ends one connection; the others go on."""
    bystander = Client(port, 2)
    bystander.send(b"GET_STATUS", b"first")
    bystander.wait_for("STATUS", "first")

    client = Client(port, 2)  # a wrong checksum, and sizes that do not fit: left out
    client.send(b"STATUS", b"x", b"", crc=1)
    body = struct.pack(">HHII", 0xFFFF, 0xFFFF, 0xFFFFFFFF, 0)
    client.socket.sendall(HEADER.pack(2, b"TRANSFORM", b"x", 0, len(body), crc64(body)) + body)
    client.send(b"TRANSFORM", b"x", b"too short")
    client.send(b"GET_STATUS", b"still")
    client.wait_for("STATUS", "still")
    client.close()

    for garbage in (b"\xff" * 200, b"GET / HTTP/1.1\r\nHost: localhost\r\nAccept: */*\r\nConnection: close\r\n\r\n",
                    HEADER.pack(3, b"STATUS", b"", 0, 0, 0), HEADER.pack(1, b"\x01\x02", b"", 0, 0, 0),
                    HEADER.pack(2, b"IMAGE", b"", 0, 1 << 62, 0)):
        client = Client(port, 1)
        client.socket.sendall(garbage)
        check(client.is_closed(), "%r is listened to" % garbage)
        client.close()

    client = Client(port, 1)  # a hundred faulty messages are no mistake any more
    try:
        for _ in range(100):
            client.send(b"STATUS", b"", b"abc", crc=1)
    except ConnectionError:
        pass
    check(client.is_closed(), "a client that is wrong a hundred times is listened to")

    client = Client(port, 2)  # cut off within a message
    client.socket.sendall(client.bytes_of(b"TRANSFORM", b"x", b"\0" * 48)[:90])
    client.close()

    crowd = [Client(port, 1) for _ in range(12)]
    closed = 0
    for client in crowd:
        client.socket.settimeout(PATIENCE_S)
        try:
            closed += client.socket.recv(1) == b""
        except ConnectionError:
            closed += 1
    # One is there, and the one that was cut off may still be.
    check(5 <= closed <= 6, "%d of 12 are refused, and 8 have a place" % closed)
    for client in crowd:
        client.close()

    bystander.send(b"GET_STATUS", b"last")
    bystander.wait_for("STATUS", "last")
    bystander.close()
    for version in (1, 2):
        until = time.monotonic() + PATIENCE_S
        while True:  # the places of the crowd are free again soon
            client = Client(port, version)
            try:
                client.send(b"GET_STATUS", b"again")
                client.wait_for("STATUS", "again")
                break
            except ConnectionError:
                check(time.monotonic() < until, "nobody is let in any more")
                time.sleep(0.05)
        client.close()
    print("faults: the server lives")


def tool(port, name):
    """The probe goes where the tool's TRANSFORM says."""
    client = Client(port, 2)
    target = (-15.0, -35.0, 70.0)  # mm, RAS
    rotation = (0.0, 1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 1.0)  # a quarter of a turn around z
    until = time.monotonic() + PATIENCE_S
    while True:
        check(time.monotonic() < until, "the probe does not get there")
        client.send(b"TRANSFORM", b"Other", struct.pack(">12f", *rotation, 1.0, 2.0, 3.0))
        client.send(b"TRANSFORM", name.encode(), struct.pack(">12f", *rotation, *target))
        stylus = client.wait_for("TRANSFORM", "Stylus").matrix()
        if max(abs(a - b) for a, b in zip(stylus[3], target)) < 1e-4:
            break
    turned = [value for column in stylus[:3] for value in column]
    check(max(abs(a - b) for a, b in zip(turned, rotation)) < 1e-5, "the probe is turned by %r" % turned)
    client.close()
    print("tool: the probe is at %r mm" % (stylus[3],))


def main(arguments):
    what = arguments[0]
    if what == "session":
        session(int(arguments[1]), int(arguments[2]), int(arguments[3]), arguments[4])
    elif what == "compare":
        compare(arguments[1], arguments[2:])
    elif what == "faults":
        faults(int(arguments[1]))
    elif what == "tool":
        tool(int(arguments[1]), arguments[2])
    else:
        raise SystemExit(__doc__)


main(sys.argv[1:])
