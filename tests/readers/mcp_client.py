"""Talks to `shibo mcp` by the library mcp, in both protocol eras that it knows.

    mcp_client.py SHIBO    the program, built with `--features mcp`

Lists the tools, checks a graph, renders a thumbnail, is refused a path outside of its folder, and closes. The library checks
every answer by the schema that the tool states. Prints one line; the exit code is 0 if all went well.
"""
import asyncio
import base64
import json
import os
import pathlib
import sys
import tempfile
import time

from mcp import ClientSession, StdioServerParameters
from mcp.client.stdio import stdio_client

try:
    from mcp import Client
except ImportError:
    Client = None

GRAPH = '(canvas: (size_mm: 20), nodes: { "a": Perlin(size: 5) }, outputs: { "a": "a" })'
LARGE = "x" * (9 << 20)


def plain(answer):
    """An answer with the names of the protocol, whatever the version of the library calls them."""
    return answer.model_dump(by_alias=True, mode="json")


async def call(client, tool, **arguments):
    """The structured content of a call, the whole answer, and whether the call succeeded."""
    answer = plain(await client.call_tool(tool, arguments))
    content = answer["structuredContent"]
    assert json.loads(answer["content"][0]["text"]) == content, tool
    return content, answer, not answer.get("isError")


async def talk(client):
    tools = [plain(tool) for tool in (await client.list_tools()).tools]
    names = [tool["name"] for tool in tools]
    assert "check" in names and "render" in names and "write" in names, names
    for tool in tools:
        assert tool["inputSchema"]["type"] == "object", tool["name"]
        assert tool["outputSchema"]["type"] == "object", tool["name"]

    found, _, good = await call(client, "search_nodes", words="blur")
    assert good and any(node["kind"] == "Blur" for node in found["nodes"]), found
    manual, _, good = await call(client, "describe_node", kind="Perlin")
    assert good and "```" in manual["manual"], manual
    graphs, _, good = await call(client, "list_graphs", words="calf")
    assert good and any(graph["path"] == "shibo:calf" for graph in graphs["graphs"]), graphs

    checked, _, good = await call(client, "check", path="a.ron")
    assert good and checked["errors"] == [], checked
    checked, _, good = await call(client, "check", text=GRAPH.replace("Perlin", "Perlim"))
    assert good and checked["errors"][0]["code"] == "unknown-kind", checked

    facts, answer, good = await call(client, "render", path="a.ron", output="a", size=64)
    assert good and facts["size"] == [64, 64], facts
    picture = answer["content"][1]
    assert picture["mimeType"] == "image/png", picture
    assert base64.b64decode(picture["data"]).startswith(b"\x89PNG"), "the picture is no PNG"
    side = {"path": "a.ron", "output": "a", "size": 128}
    compared, _, good = await call(client, "compare", a=side, b=side)
    assert good and compared["distance"] < 1e-6, compared

    for path in ("../secret.ron", "/etc/passwd", "~/a.ron"):
        refused, _, good = await call(client, "check", path=path)
        assert not good and refused["refused"]["code"] == "outside", refused
    # A line that is too long is an answer of its own, and the connection goes on.
    try:
        await asyncio.wait_for(client.call_tool("check", {"text": LARGE}), 20)
        raise AssertionError("a long line was accepted")
    except (asyncio.TimeoutError, TimeoutError) as silent:
        raise AssertionError("a long line has no answer") from silent
    except AssertionError:
        raise
    except Exception as error:  # The library has its own class of errors in each version.
        assert "longer than 8 MiB" in str(error), error
    _, _, good = await call(client, "check", path="a.ron")
    assert good


async def main(program):
    eras = []
    with tempfile.TemporaryDirectory() as folder:
        data = pathlib.Path(folder) / "data"
        data.mkdir()
        (data / "a.ron").write_text(GRAPH)
        (pathlib.Path(folder) / "secret.ron").write_text(GRAPH)
        env = {**os.environ, "XDG_CACHE_HOME": folder}
        server = StdioServerParameters(command=program, args=["mcp", "--read", str(data)], env=env)
        async with stdio_client(server) as (read, write):
            async with ClientSession(read, write) as session:
                begun = plain(await session.initialize())
                assert begun["serverInfo"]["name"] == "shibo", begun
                eras.append(begun["protocolVersion"])
                await talk(session)
            end = time.monotonic()
        assert time.monotonic() - end < 3, "the end of stdin does not end the server"
        if Client is not None:
            async with Client(server, mode="auto") as client:
                session = client.session
                version = getattr(session, "protocol_version", None)
                if version not in eras:
                    eras.append(version)
                    await talk(client)
    print(f"mcp: tools, schemas, check, render, compare, refusals in protocol {' and '.join(eras)}")


asyncio.run(main(str(pathlib.Path(sys.argv[1]).resolve())))
