// The view of an entry of one or several lines while it is typed, and the bytes that update the screen.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "shell/input/highlight.hpp"

namespace pendula::shell {

struct Entry {
  std::string_view text;
  std::size_t cursor = 0;   ///< offset in the text
  std::string_view prompt;  ///< in front of the first line; the others have next_prompt
  std::string_view ghost;   ///< shown faintly behind the text: what the history suggests
  bool coloured = false;
  std::vector<Style> styles;  ///< one per byte of the text, if coloured
};

/// The rows of the screen that an entry takes, each with its escape sequences for
/// colour, and where the cursor is.
struct Picture {
  std::vector<std::string> rows;
  std::vector<bool> wrapped;  ///< row i goes on in row i + 1 because the window is full, not at a line break
  std::size_t cursor_row = 0;
  int cursor_column = 0;
};

Picture picture(const Entry& entry, int columns);

/// The part of an entry that the terminal shows. Its functions return the bytes that make the terminal show
/// the next thing: written at once, nothing flickers.
class EntryView {
 public:
  /// The cursor stands at the beginning of an empty row, and nothing of an entry is above it.
  void begin() { above_ = top_ = 0; }

  /// Shows the entry; of one that is higher than the window, the part around the cursor.
  std::string show(const Entry& entry, int columns, int window_rows);

  /// Shows the entry a last time and puts the cursor below it.
  std::string leave(const Entry& entry, int columns, int window_rows);

  /// The window has another width, and the terminal has wrapped its rows anew.
  void resized(const Entry& entry, int columns) { above_ = picture(entry, columns).cursor_row; }

 private:
  std::size_t above_ = 0;  ///< rows on the screen between the entry's first shown row and the cursor
  std::size_t top_ = 0;    ///< the first row that is shown
};

}  // namespace pendula::shell
