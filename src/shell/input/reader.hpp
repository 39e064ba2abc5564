// Where the lines of a session come from: GNU readline on a terminal, plain reading elsewhere.
//
// readline_reader.cpp and plain_reader.cpp are the two, open_reader.cpp chooses. For the first one:
// entry_view.hpp draws entries of several lines, lines_of_entry.hpp moves in them, highlight.hpp colours
// them, word_list.hpp lists what Tab offers, signals.hpp waits without losing Ctrl-C; history.hpp and
// journal.hpp keep what was typed.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "shell/completion/completions.hpp"
#include "shell/input/highlight.hpp"

namespace pendula::shell {

struct Line {
  enum class Kind {
    text,
    abandoned,  ///< Ctrl-C: what was typed is gone
    end,        ///< Ctrl-D on an empty line, or the end of the input
  };
  Kind kind;
  std::string text;
};

class Reader {
 public:
  virtual ~Reader() = default;

  /// Waits for an entry. `pending` is what was typed before on it, "" if nothing was; the text that comes
  /// back begins with it, as the user has left it, and is not necessarily complete.
  virtual Line read(const std::string& pending) = 0;

  /// Keeps an entry for recall: one history entry, however many lines it has.
  virtual void remember(const std::string& entry) = 0;
};

/// Services of the language for a reader with editing.
struct Knowledge {
  Completer complete;
  std::function<bool(const std::string& entry)> is_complete;  ///< or do more lines belong to it?
  NameLookup kind;
};

/// A reader on standard input. With line editing if the build has it
/// (PENDULA_READLINE) and a person is typing.
std::unique_ptr<Reader> open_reader(Knowledge knowledge);

/// Was the program built with readline?
bool has_line_editing();

std::unique_ptr<Reader> open_plain_reader();
std::unique_ptr<Reader> open_readline_reader(Knowledge knowledge);  ///< only with PENDULA_READLINE

inline constexpr std::string_view first_prompt = "> ";
/// In front of the further lines of an entry; ASCII where the terminal shows nothing else.
std::string_view next_prompt();

}  // namespace pendula::shell
