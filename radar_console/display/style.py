"""The one style sheet, made from a palette."""

from radar_console.display.fonts import LARGE, MONO, SANS, SMALL
from radar_console.display.palette import Palette, code, mix


def sheet(palette: Palette) -> str:
    """Qt style sheet of the whole window."""
    p = palette
    row = code(mix(p.panel, p.track, 0.12))
    field = code(mix(p.panel, p.background, 0.6))
    return f"""
* {{ font-family: "{SANS}"; font-size: {SMALL}px; color: {code(p.text)}; }}
QMainWindow, #back {{ background: {code(p.background)}; }}
#panel {{ background: {code(p.panel)}; }}
QSplitter::handle {{ background: {code(p.hairline)}; }}
#heading {{ color: {code(p.dim)}; font-weight: bold; letter-spacing: 1px; }}
#figures, #caption, #hint {{ color: {code(p.dim)}; }}
#figures, #value, #hint, #status QLabel {{ font-family: "{MONO}"; }}
#value {{ color: {code(p.text)}; }}
#name {{ color: {code(p.bright)}; font-size: {LARGE}px; font-weight: bold; }}
#line {{ background: {code(p.hairline)}; }}
#status {{ background: {code(p.panel)}; border-top: 1px solid {code(p.hairline)}; }}
#status QLabel[state="dim"] {{ color: {code(p.dim)}; }}
#status QLabel[state="good"] {{ color: {code(p.good)}; }}
#status QLabel[state="warning"] {{ color: {code(p.warning)}; }}
#status QLabel[state="alarm"] {{ color: {code(p.alarm)}; font-weight: bold; }}
#banner {{ background: {code(p.panel)}; padding: 5px 14px; font-weight: bold;
  border-left: 3px solid {code(p.dim)}; color: {code(p.text)}; }}
#banner[state="alarm"] {{ border-left-color: {code(p.alarm)}; color: {code(p.alarm)}; }}
QLineEdit {{ background: {field}; border: none; border-bottom: 1px solid {code(p.hairline)};
  padding: 5px 8px; selection-background-color: {row}; placeholder-text-color: {code(p.dim)}; }}
QLineEdit:focus {{ border-bottom-color: {code(p.dim)}; }}
QTableView {{ background: {code(p.panel)}; border: none; font-family: "{MONO}"; outline: none;
  selection-background-color: {row}; selection-color: {code(p.bright)}; }}
QTableView::item {{ padding: 0 0 0 7px; border: none; }}
QTableView::item:selected {{ background: {row}; }}
QHeaderView {{ background: {code(p.panel)}; border: none; }}
QHeaderView::section {{ background: {code(p.panel)}; color: {code(p.dim)}; border: none;
  border-bottom: 1px solid {code(p.hairline)}; padding: 4px 3px 4px 10px; }}
QHeaderView::up-arrow, QHeaderView::down-arrow {{ width: 0; height: 0; }}
QScrollBar:vertical {{ background: {code(p.panel)}; width: 8px; margin: 0; }}
QScrollBar::handle:vertical {{ background: {code(p.hairline)}; min-height: 24px; border-radius: 4px; }}
QScrollBar[idle="true"]::handle:vertical {{ background: none; }}
QScrollBar::add-line, QScrollBar::sub-line, QScrollBar::add-page, QScrollBar::sub-page
  {{ height: 0; background: none; }}
QToolTip {{ background: {code(p.panel)}; color: {code(p.text)}; border: 1px solid {code(p.hairline)}; }}
#help {{ background: {code(p.panel)}; border: 1px solid {code(p.hairline)}; }}
#help #key {{ font-family: "{MONO}"; color: {code(p.bright)}; }}
"""
