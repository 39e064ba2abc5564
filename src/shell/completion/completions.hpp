// Completions as data, from the finder to the line editor.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace pendula::shell {

/// Completions of the end of the text typed so far.
struct Completions {
  std::size_t begin = 0;           ///< offset in the text of the word to complete
  std::vector<std::string> words;  ///< replacements for the word, sorted
  char quote = '\0';               ///< inside a string: the quote that opened it
  bool globals = false;            ///< the words are global names and keywords
  bool files = false;              ///< names of files may stand here, and `words` is not used
};

/// `text` is the entry up to the cursor. Must not throw.
using Completer = std::function<Completions(std::string_view text)>;

}  // namespace pendula::shell
