// The words that Tab offers, listed below the entry.
#pragma once

#include <string>
#include <vector>

#include "shell/input/highlight.hpp"

namespace pendula::shell {

struct ListRoom {
  int columns, rows;
  bool coloured;
};

/// The words in columns, one group below the other: variables of the session, vocabulary, keywords,
/// where `kind` says which is which; without it all in one. Of more words than rows have room for the
/// last line says how many are left.
std::string word_list(std::vector<std::string> words, const NameLookup& kind, ListRoom room);

}  // namespace pendula::shell
