// Output at a terminal: fitted to its width, and a screen at a time where it is longer.
#pragma once

#include <cstdio>
#include <string>
#include <string_view>

namespace pendula::lua {

/// The size of the terminal on standard output at this moment; columns = 0: it is
/// none, and nothing is fitted.
struct ScreenSize {
  int columns = 0, rows = 0;
};
ScreenSize screen_size();

/// The text in ASCII where standard output is a terminal whose locale has nothing else, else unchanged.
std::string showable(const std::string& text);

/// The text as the terminal on standard error shows it: fitted to its width, in ASCII where nothing else can
/// be shown. Unchanged where standard error is no terminal.
std::string for_errors(const std::string& text);

/// "warning: …" on standard error.
void warn(const std::string& text);

/// From now on a person waits at a prompt for what is shown.
void page_long_text();

/// Writes the lines to standard output. Where a person waits, text that is longer than the screen stops after
/// every screen: Space and Enter go on, q leaves. Anywhere else everything is written at once.
void show_text(const std::string& text);

/// Bytes that a pipe takes whole or not at all (PIPE_BUF of Linux): a write of more that waits for a reader
/// goes on after a signal, one of these ends.
constexpr std::size_t whole_piece = 4096;

/// Writes until everything is written, an error, or Ctrl-C; false: something is left.
bool write_stoppable(std::string_view bytes, std::FILE* file);

}  // namespace pendula::lua
