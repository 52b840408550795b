# SPDX-License-Identifier: BSD-3-Clause
"""Small encoder of random messages for tests: definitions, bytes and positions of the stamps."""
from hypothesis import strategies as st

PRIMITIVES = {'bool': 1, 'int8': 1, 'uint8': 1, 'byte': 1, 'char': 1, 'int16': 2, 'uint16': 2,
              'int32': 4, 'uint32': 4, 'int64': 8, 'uint64': 8, 'float32': 4, 'float64': 8,
              'time': 8, 'duration': 8}
HEADER = [('uint32', '', 'seq'), ('time', '', 'stamp'), ('string', '', 'frame_id')]
NOISE = ['# a comment = none', '', 'string GREETING = hello # "world" = 1', 'int32 LIMIT=-5']


@st.composite
def definitions(draw):
    """Return {type: [(type, array, name)]}; the first is the message, which uses all others."""
    count = draw(st.integers(1, 4))
    types = {f'pkg{index}/Type{index}': [] for index in range(count)}
    names = list(types)
    for index, name in enumerate(names):
        known = [*PRIMITIVES, 'string', 'time', 'Header', *names[index + 1:]]
        for number in range(draw(st.integers(0, 5))):
            kind = draw(st.sampled_from(known))
            array = draw(st.sampled_from(['', '', '[]', '[0]', '[1]', '[3]']))
            stamp = kind == 'time' and draw(st.booleans()) and 'stamp' not in (
                field[2] for field in types[name])
            types[name].append((kind, array, 'stamp' if stamp else f'field_{number}'))
    types['std_msgs/Header'] = HEADER
    return types


def as_text(draw, types):
    blocks = []
    for index, (name, fields) in enumerate(types.items()):
        lines = [f'{kind}{array}  {field} # {kind}' for kind, array, field in fields]
        for noise in draw(st.lists(st.sampled_from(NOISE), max_size=2)):
            lines.insert(draw(st.integers(0, len(lines))), noise)
        blocks.append('\n'.join(([f'MSG: {name}'] if index else []) + lines))
    return ('\n' + '=' * 80 + '\n').join(blocks)


def encode(draw, types, kind, data, stamps):
    """Append a random value of a type; note the offsets of its stamps."""
    if kind in PRIMITIVES:
        data += draw(st.binary(min_size=PRIMITIVES[kind], max_size=PRIMITIVES[kind]))
    elif kind == 'string':
        text = draw(st.binary(max_size=6))
        data += len(text).to_bytes(4, 'little') + text
    else:
        for element, array, name in types['std_msgs/Header' if kind == 'Header' else kind]:
            if element == 'time' and name == 'stamp' and not array:
                stamps.append(len(data))
            count = int(array[1:-1]) if array[1:-1] else 1
            if array == '[]':
                count = draw(st.integers(0, 3))
                data += count.to_bytes(4, 'little')
            for _ in range(count):
                encode(draw, types, element, data, stamps)


@st.composite
def messages(draw):
    """Return a type name, its definition, the bytes of a message and the offsets of its stamps."""
    types = draw(definitions())
    name, data, stamps = next(iter(types)), bytearray(), []
    encode(draw, types, name, data, stamps)
    return name, as_text(draw, types), bytes(data), stamps
