"""Tables in HTML: texts as they are, numbers to the right."""

from __future__ import annotations

from space_robot_msgs_py.config.html import html_table


def test_texts_are_escaped_and_numbers_are_on_the_right() -> None:
    shown = html_table(("a<b", "c"), [["<script>", "-1.5e3"]], "x & y")
    assert shown == (
        "<p>x &amp; y</p><table><tr><th>a&lt;b</th><th>c</th></tr>"
        '<tr><td style="text-align: left">&lt;script&gt;</td>'
        '<td style="text-align: right">-1.5e3</td></tr></table>'
    )


def test_long_texts_are_cut_and_no_rows_are_no_table() -> None:
    assert f">{200 * 'x'}...<" in html_table(("a",), [[300 * "x"]])
    assert html_table(("a",), [], "nothing") == "<p>nothing</p>"
