"""The front process on this side: how long it waits for whom."""

import asyncio
import random

import pytest

from moldline.server import connection, listening, protocol
from moldline.server.cases import Cases
from moldline.server.front import Front
from moldline.server.holder import Spare


def frame(header):
    """A frame without arrays."""
    return b"".join(protocol.encode(header))


HELLO = frame({"id": 0, "op": "hello", "protocol": protocol.PROTOCOL})


@pytest.fixture
def served(tmp_path, monkeypatch):
    """Runs what talks to a server, which waits for nobody for long."""
    monkeypatch.setattr(connection, "TO_GREET", 0.3)
    monkeypatch.setattr(connection, "TO_ARRIVE", 0.3)
    path = tmp_path / "socket"

    async def run(talk):
        front = Front(Cases(1, 60.0, Spare(False)))
        with listening.at_path(path) as ours:
            serving = asyncio.create_task(front.serve(ours))
            try:
                await asyncio.wait_for(talk(str(path)), 20)
            finally:
                front.stop()
                await serving

    return lambda talk: asyncio.run(run(talk))


async def answer(reader):
    """The header of an answer."""
    header, body = protocol.lengths(await reader.readexactly(protocol.PREFIX.size))
    found = protocol.parsed(await reader.readexactly(header))
    await reader.readexactly(body)
    return found


async def greeted(path):
    """A client that was let in."""
    reader, writer = await asyncio.open_unix_connection(path)
    writer.write(HELLO)
    assert (await answer(reader))["ok"]
    return reader, writer


def test_who_says_nothing_or_half_a_frame_is_let_go(served):
    async def talk(path):
        silent = await asyncio.open_unix_connection(path)
        half, whole = await greeted(path), await greeted(path)
        half[1].write(frame({"id": 1, "op": "ping"})[:20])
        assert await silent[0].read() == b"" and await half[0].read() == b""
        await asyncio.sleep(0.4)  # who has asked nothing for long may stay
        whole[1].write(frame({"id": 1, "op": "ping"}))
        assert (await answer(whole[0]))["id"] == 1
        for _, writer in (silent, half, whole):
            writer.close()

    served(talk)


def test_who_reads_no_answers_is_let_go_and_holds_up_nobody(served):
    async def talk(path):
        deaf, other = await greeted(path), await greeted(path)
        deaf[0]._transport.pause_reading()
        ask = frame({"id": "x" * 2**20, "op": "ping"})

        async def shout():
            while True:
                deaf[1].write(ask)
                await deaf[1].drain()

        with pytest.raises(ConnectionError):
            await shout()
        other[1].write(frame({"id": 1, "op": "ping"}))
        assert (await answer(other[0]))["ok"]
        for _, writer in (deaf, other):
            writer.close()

    served(talk)


def test_noise_of_any_kind_leaves_the_server_as_it_was(served):
    noise = random.Random(0)

    async def talk(path):
        for number in range(60):
            opened = greeted(path) if number % 2 else asyncio.open_unix_connection(path)
            _, writer = await opened
            data = noise.randbytes(noise.randrange(200))
            if number % 3:
                data = protocol.PREFIX.pack(protocol.MAGIC, noise.randrange(50), 8) + data
            writer.write(data)
            writer.close()
        reader, writer = await greeted(path)
        writer.write(frame({"id": 1, "op": "list"}))
        assert (await answer(reader))["cases"] == []
        writer.close()

    served(talk)
