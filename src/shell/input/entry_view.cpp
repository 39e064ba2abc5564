#include "shell/input/entry_view.hpp"

#include <algorithm>
#include <cwchar>

#include "shell/input/reader.hpp"

namespace pendula::shell {
namespace {

constexpr std::string_view plain = "\033[0m", prompt_colour = "\033[1;34m", faint = "\033[90m";

std::string_view colour(Style style) {
  switch (style) {
    case Style::keyword:
      return "\033[35m";
    case Style::string:
      return "\033[32m";
    case Style::number:
      return "\033[36m";
    case Style::comment:
      return faint;
    case Style::vocabulary:
      return "\033[34m";
    case Style::own:
      return "\033[1m";
    case Style::bracket:
      return "\033[1;7m";
    case Style::plain:
      break;
  }
  return plain;
}

/// The displayed form of the character at text[at], its number of cells and of bytes.
struct Glyph {
  std::string text;
  int cells = 1;
  std::size_t bytes = 1;
};

Glyph glyph(std::string_view text, std::size_t at) {
  const char c = text[at];
  if (c == '\t') return {"    ", 4, 1};
  if (static_cast<unsigned char>(c) < 32 || c == 127) return {{'^', static_cast<char>(c ^ 64)}, 2, 1};
  wchar_t wide = 0;
  std::mbstate_t state = {};
  const std::size_t bytes = std::mbrtowc(&wide, text.data() + at, text.size() - at, &state);
  if (bytes == 0 || bytes > text.size() - at)
    return {"\uFFFD", 1, 1};  // an incomplete character or one in another encoding
  return {std::string(text.substr(at, bytes)), std::max(0, wcwidth(wide)), bytes};
}

/// Puts glyphs into rows of at most `columns` cells.
class Painter {
 public:
  Painter(int columns, bool coloured) : columns_(columns), coloured_(coloured) {
    result_.rows.emplace_back();
  }

  void put(std::string_view text, std::size_t& at, std::string_view with) {
    const Glyph next = glyph(text, at);
    if (column_ + next.cells > columns_) row(true);
    if (coloured_ && with != colour_) result_.rows.back().append(plain).append(with);
    colour_ = with;
    result_.rows.back() += next.text;
    column_ += next.cells;
    at += next.bytes;
  }

  void put_all(std::string_view text, std::string_view with) {
    for (std::size_t at = 0; at < text.size();) put(text, at, with);
  }

  void row(bool wrapped) {
    if (coloured_ && colour_ != plain) result_.rows.back() += plain;
    colour_ = plain;
    result_.rows.emplace_back();
    result_.wrapped.push_back(wrapped);
    column_ = 0;
  }

  /// Puts the cursor before the next glyph, at the beginning of the next row if this one is full.
  void mark_cursor() {
    if (column_ >= columns_) row(true);
    result_.cursor_row = result_.rows.size() - 1;
    result_.cursor_column = column_;
  }

  int room() const { return columns_ - column_; }

  Picture finish() {
    if (coloured_ && colour_ != plain) result_.rows.back() += plain;
    result_.wrapped.push_back(false);
    return std::move(result_);
  }

 private:
  int columns_, column_ = 0;
  bool coloured_;
  std::string_view colour_ = plain;
  Picture result_;
};

/// The beginning of the first line of a suggestion that fits into the row.
std::string fitted_ghost(std::string_view ghost, int room) {
  std::string shown;
  int cells = 0;
  for (std::size_t at = 0; at < ghost.size() && ghost[at] != '\n';) {
    const Glyph next = glyph(ghost, at);
    if ((cells += next.cells) >= room) break;
    shown += next.text;
    at += next.bytes;
  }
  return shown;
}

}  // namespace

Picture picture(const Entry& entry, int columns) {
  Painter painter(std::max(columns, 8), entry.coloured);
  painter.put_all(entry.prompt, prompt_colour);
  for (std::size_t at = 0; at < entry.text.size();) {
    if (at == entry.cursor) painter.mark_cursor();
    if (entry.text[at] == '\n') {
      painter.row(false);
      painter.put_all(next_prompt(), prompt_colour);
      ++at;
    } else {
      painter.put(entry.text, at, entry.coloured ? colour(entry.styles[at]) : plain);
    }
  }
  if (entry.cursor >= entry.text.size()) painter.mark_cursor();
  if (!entry.ghost.empty()) painter.put_all(fitted_ghost(entry.ghost, painter.room()), faint);
  return painter.finish();
}

std::string EntryView::show(const Entry& entry, int columns, int window_rows) {
  const Picture now = picture(entry, columns);
  const auto height = static_cast<std::size_t>(std::max(window_rows, 2));
  top_ = std::min(top_, now.cursor_row);
  if (now.cursor_row >= top_ + height) top_ = now.cursor_row + 1 - height;
  if (now.rows.size() <= height) top_ = 0;
  const std::size_t end = std::min(now.rows.size(), top_ + height);

  std::string bytes = above_ > 0 ? "\033[" + std::to_string(above_) + "A" : "";
  bytes += "\r\033[J";
  for (std::size_t i = top_; i < end; ++i) {
    bytes += now.rows[i];
    if (i + 1 < end && !now.wrapped[i]) bytes += "\r\n";
    // The terminal continues a wrapped row in the next one by itself and treats both as one line. If the next
    // row is empty, a blank makes it wrap.
    if (i + 1 < end && now.wrapped[i] && now.rows[i + 1].empty()) bytes += " \r\033[K";
  }
  if (const std::size_t below = end - 1 - now.cursor_row; below > 0)
    bytes += "\033[" + std::to_string(below) + "A";
  bytes += "\r";
  if (now.cursor_column > 0) bytes += "\033[" + std::to_string(now.cursor_column) + "C";
  above_ = now.cursor_row - top_;
  return bytes;
}

std::string EntryView::leave(const Entry& entry, int columns, int window_rows) {
  Entry last = entry;
  last.cursor = entry.text.size();
  last.ghost = {};
  std::string bytes = show(last, columns, window_rows) + "\r\n";
  begin();
  return bytes;
}

}  // namespace pendula::shell
