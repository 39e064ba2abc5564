#include "shell/input/terminal.hpp"

#include <langinfo.h>
#include <unistd.h>

#include <clocale>
#include <cstdlib>

namespace pendula::shell {

bool is_terminal(int fd) { return isatty(fd) == 1; }

bool has_colour(int fd) {
  const char* refused = std::getenv("NO_COLOR");
  if (refused && *refused) return false;
  const char* term = std::getenv("TERM");
  return is_terminal(fd) && term && *term && std::string_view(term) != "dumb";
}

void refuse_colour() { setenv("NO_COLOR", "1", 1); }

std::string red(std::string_view text, int fd) {
  return has_colour(fd) ? "\033[31m" + std::string(text) + "\033[0m" : std::string(text);
}

void use_utf8() {
  std::setlocale(LC_CTYPE, "");
  if (std::string_view(nl_langinfo(CODESET)) != "UTF-8") std::setlocale(LC_CTYPE, "C.UTF-8");
}

}  // namespace pendula::shell
