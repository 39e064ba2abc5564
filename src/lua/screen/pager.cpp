#include "lua/screen/pager.hpp"

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string_view>

#include <poll.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include "base/interrupt.hpp"
#include "base/text.hpp"
#include "lua/screen/fit_text.hpp"

namespace pendula::lua {
namespace {

bool a_person_waits = false;

/// Switches line editing and echo of the terminal off during its lifetime.
class RawTerminal {
 public:
  RawTerminal() {
    good_ = tcgetattr(STDIN_FILENO, &saved_) == 0;
    termios raw = saved_;
    raw.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO | ISIG);
    raw.c_cc[VMIN] = 1;
    raw.c_cc[VTIME] = 0;
    good_ = good_ && tcsetattr(STDIN_FILENO, TCSANOW, &raw) == 0;
  }
  ~RawTerminal() {
    if (good_) tcsetattr(STDIN_FILENO, TCSANOW, &saved_);
  }
  RawTerminal(const RawTerminal&) = delete;
  RawTerminal& operator=(const RawTerminal&) = delete;
  bool good() const { return good_; }

 private:
  termios saved_{};
  bool good_ = false;
};

bool input_waits() {
  pollfd keyboard{STDIN_FILENO, POLLIN, 0};
  return poll(&keyboard, 1, 0) > 0;
}

/// The number of lines to show next: a screen, one, or none.
enum class PagerKey { screen, line, leave };

PagerKey ask() {
  std::fputs("-- more: Space or Enter, q leaves --", stdout);
  std::fflush(stdout);
  char key = 'q';
  const bool read_one = read(STDIN_FILENO, &key, 1) == 1;
  std::fputs("\r\033[K", stdout);
  constexpr char ctrl_c = 3, ctrl_d = 4, escape = 27;
  if (!read_one || key == 'q' || key == 'Q' || key == ctrl_c || key == ctrl_d) return PagerKey::leave;
  if (key == escape) {  // an arrow key, whose other bytes are not keys
    char rest[8];
    while (input_waits() && read(STDIN_FILENO, rest, sizeof rest) > 0) continue;
    return PagerKey::line;
  }
  return key == '\n' || key == '\r' || key == 'j' ? PagerKey::line : PagerKey::screen;
}

int rows_of(std::string_view line, int columns) {
  return columns > 0 ? std::max(1, (display_width(line) + columns - 1) / columns) : 1;
}

/// Writes lines from `text` that take up to `rows` rows, and removes them from it.
void write_rows(std::string_view& text, int rows, int columns) {
  while (!text.empty()) {
    const std::string_view line = text.substr(0, text.find('\n'));
    rows -= rows_of(line, columns);
    if (rows < 0) return;
    const std::size_t size = std::min(line.size() + 1, text.size());
    std::fwrite(text.data(), 1, size, stdout);
    text.remove_prefix(size);
  }
}

int total_rows(std::string_view text, int columns) {
  int rows = 0;
  while (!text.empty()) {
    const std::string_view line = text.substr(0, text.find('\n'));
    rows += rows_of(line, columns);
    text.remove_prefix(std::min(line.size() + 1, text.size()));
  }
  return rows;
}

bool only_ascii() {
  for (const char* name : {"LC_ALL", "LC_CTYPE", "LANG"}) {
    const char* value = std::getenv(name);
    if (value && *value) return std::strcmp(value, "C") == 0 || std::strcmp(value, "POSIX") == 0;
  }
  return false;
}

}  // namespace

static ScreenSize size_of_terminal(int descriptor) {
  if (!isatty(descriptor)) return {};
  winsize size{};
  if (ioctl(descriptor, TIOCGWINSZ, &size) != 0 || size.ws_col == 0) return {};
  return {size.ws_col, size.ws_row};
}

ScreenSize screen_size() { return size_of_terminal(STDOUT_FILENO); }

static std::string spelled(const std::string& text, int descriptor) {
  return only_ascii() && isatty(descriptor) ? in_ascii(text) : text;
}

std::string showable(const std::string& text) { return spelled(text, STDOUT_FILENO); }

std::string for_errors(const std::string& text) {
  const int columns = size_of_terminal(STDERR_FILENO).columns;
  const std::string shown = spelled(text, STDERR_FILENO);
  return columns == 0 ? shown : fitted(shown, columns);
}

void warn(const std::string& text) {
  std::fflush(stdout);
  std::fputs((for_errors("warning: " + text) + "\n").c_str(), stderr);
}

void page_long_text() { a_person_waits = true; }

void show_text(const std::string& text) {
  const ScreenSize screen = screen_size();
  const std::string shown = showable(text);
  std::string_view rest = shown;
  constexpr int longest_measured = 1 << 22;  // bytes
  const bool paged = a_person_waits && screen.rows > 4 && isatty(STDIN_FILENO) && !input_waits() &&
                     rest.size() < longest_measured && total_rows(rest, screen.columns) >= screen.rows;
  if (paged) {
    const RawTerminal raw;
    write_rows(rest, screen.rows - 1, screen.columns);
    while (raw.good() && !rest.empty()) {
      const PagerKey key = ask();
      if (key == PagerKey::leave) {
        std::fflush(stdout);
        return;
      }
      write_rows(rest, key == PagerKey::line ? 1 : screen.rows - 1, screen.columns);
    }
  }
  if (write_stoppable(rest, stdout)) std::fflush(stdout);
}

bool write_stoppable(std::string_view bytes, std::FILE* file) {
  while (!bytes.empty() && !interrupt_requested.load()) {
    const std::string_view piece = bytes.substr(0, whole_piece);
    if (std::fwrite(piece.data(), 1, piece.size(), file) < piece.size()) break;
    bytes.remove_prefix(piece.size());
  }
  return bytes.empty();
}

}  // namespace pendula::lua
