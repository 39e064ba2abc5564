"""What the readers' fuzzer begins with, and what it has found: (reader, bytes); readers as in fuzz.cpp."""
import struct


def element(kind, data):
    return struct.pack("<II", kind, len(data)) + data + b"\0"*(-len(data) % 8)


def matrix(class_type, rows, cols, *parts, nonzeros=0):
    return element(14, element(6, struct.pack("<II", class_type, nonzeros)) + element(5, struct.pack("<ii", rows, cols))
                   + element(1, b"y") + b"".join(parts))


def doubles(*values):
    return element(9, struct.pack(f"<{len(values)}d", *values))


def integers(*values):
    return element(5, struct.pack(f"<{len(values)}i", *values))


MAT = (b"MATLAB 5.0 MAT-file" + b" "*124)[:124] + struct.pack("<H", 0x0100) + b"IM"
SEEDS = [
    (0, b'return (var("x")^2 + sin(param("k", 2)))/3\n'),
    (0, b'local x = var "x"\nreturn dae{ der(x) ~ -param("k", 2)*x }\n'),
    (0, b'return (function() local e = {} e[1] = var("x") return e[1]*e[1] end)()\n'),
    (0, b'return tableau { A = { { 0, 0 }, { 1, 0 } }, b = { "1/2", "1/2" }, c = { 0, 1 } }\n'),
    (1, b"0 |\n1 | 1\n  | 1/2 1/2\n"),
    (1, b"1/3 | 5/12 -1/12\n1 | 3/4 1/4\n  | 3/4 1/4\n"),
    (2, b"t,y,u\n0,1.5,2\n1,2.5,3\n2,,4\n"),
    (2, b'"t s"\t"y, v"\n0\t1,5\n1\t2,5\n'),
    (3, MAT + matrix(6, 4, 1, doubles(1, 2, 3, 4))),
    (3, MAT + matrix(5, 4, 2, integers(1, 3, 0), integers(0, 2, 3), doubles(10, 30, 7), nonzeros=3)),
    (3, MAT + matrix(6, 268435460, 1, doubles(1, 2, 3, 4))),  # asked for 2 GiB
    (4, b"(3-sqrt(3))/6"),
    (5, b"local function f(...) return ... end"),
    (5, b"x = " + b"("*3000 + b"1" + b")"*3000),  # deeper than the parser goes
    (0, b"return " + b"{"*3000 + b"}"*3000),
    (0, b'local value1 = vec{1, 1e999}\nreturn { A = value1, s = "text", list = { 1, { k = "a" } } }\n'),
    (4, b"1"*5000 + b"/3"),
]


def write(folder):
    for k, (reader, data) in enumerate(SEEDS):
        with open(f"{folder}/seed{k:02}", "wb") as file:
            file.write(bytes([reader]) + data)
