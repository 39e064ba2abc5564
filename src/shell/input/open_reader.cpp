#include "shell/input/reader.hpp"

#include <unistd.h>

#include "lua/screen/pager.hpp"
#include "shell/input/terminal.hpp"

namespace pendula::shell {

bool has_line_editing() {
#ifdef PENDULA_READLINE
  return true;
#else
  return false;
#endif
}

std::string_view next_prompt() {
  static const bool ascii = lua::showable("…") != "…";
  return ascii ? ". " : "… ";
}

std::unique_ptr<Reader> open_reader([[maybe_unused]] Knowledge knowledge) {
#ifdef PENDULA_READLINE
  if (is_terminal(STDIN_FILENO)) return open_readline_reader(std::move(knowledge));
#endif
  return open_plain_reader();
}

}  // namespace pendula::shell
