// Entries as they are shown while they are typed, without a terminal.
#include <doctest/doctest.h>

#include "shell/input/entry_view.hpp"
#include "shell/input/terminal.hpp"
#include "shell/input/word_list.hpp"

namespace pendula::entry_view_test {

using namespace pendula::shell;

namespace {

NameKind kind(std::string_view name) {
  return name == "mass" ? NameKind::own : name == "dae" ? NameKind::vocabulary : NameKind::unknown;
}

/// One letter per byte of the text.
std::string styles(std::string_view text, std::size_t cursor = 0) {
  std::string letters;
  for (Style style : highlighted(text, cursor, kind)) letters += ".ksnCvob"[static_cast<int>(style)];
  return letters;
}

Picture plain_picture(std::string_view text, std::size_t cursor, int columns) {
  use_utf8();
  Entry entry;
  entry.text = text;
  entry.cursor = cursor;
  entry.prompt = "> ";
  return picture(entry, columns);
}

}  // namespace

TEST_CASE("highlight: what every byte is") {
  CHECK(styles("local mass = dae(x.dae, 1e3)") == "kkkkk.oooo...vvv........nnn.");
  CHECK(styles("f('it''s') -- note\n[[a\nb]]") == "..sssssss..CCCCCCCCsssssss");
  CHECK(styles("--[[ open\nmass") == std::string(14, 'C'));
  CHECK(styles("").empty());
}

TEST_CASE("highlight: the bracket at the cursor and its partner") {
  CHECK(styles("(a{b}c)", 0) == "b.....b");
  CHECK(styles("(a{b}c)", 7) == "b.....b");
  CHECK(styles("(a{b}c)", 2) == "..b.b..");
  CHECK(styles("(a{b}c)", 5) == "..b.b..");
  CHECK(styles("(a]", 3) == "...");  // no partners
  CHECK(styles("'(' .. ')'", 2) == "sss....sss");
  CHECK(styles(")", 1) == ".");
}

TEST_CASE("indentation of the line that follows") {
  CHECK(indentation("") == 0);
  CHECK(indentation("for i = 1, 3 do") == 2);
  CHECK(indentation("for i = 1, 3 do\n  if x then") == 4);
  CHECK(indentation("for i = 1, 3 do\n  if x then\n  end") == 2);
  CHECK(indentation("m = dae{ der(x) ~ f(") == 2);
  CHECK(indentation("m = dae{ der(x) ~ f(\n  1),") == 2);
  CHECK(indentation("repeat x() until y") == 0);
  CHECK(indentation("s = 'if then do'") == 0);
  CHECK(begins_with_end("  end)"));
  CHECK(begins_with_end("} "));
  CHECK(begins_with_end("else"));
  CHECK_FALSE(begins_with_end("x = { }"));
  CHECK_FALSE(begins_with_end(""));
}

TEST_CASE("picture: rows and the place of the cursor") {
  const Picture block = plain_picture("do\n  é = 1\nend", 7, 20);
  CHECK(block.rows == std::vector<std::string>{"> do", "…   é = 1", "… end"});
  CHECK(block.cursor_row == 1);
  CHECK(block.cursor_column == 5);  // behind é, of two bytes
  const Picture wrapped = plain_picture("123456789abc", 12, 10);
  CHECK(wrapped.rows == std::vector<std::string>{"> 12345678", "9abc"});
  CHECK(wrapped.wrapped == std::vector<bool>{true, false});
  CHECK(wrapped.cursor_row == 1);
  const Picture full = plain_picture("12345678", 8, 10);  // the cursor needs a cell of its own
  CHECK(full.rows == std::vector<std::string>{"> 12345678", ""});
  CHECK(full.cursor_row == 1);
  CHECK(full.cursor_column == 0);
  CHECK(plain_picture("a\tb\x01"
                      "c",
                      0, 20)
            .rows[0] == "> a    b^Ac");
  CHECK(plain_picture("\xff", 0, 20).rows[0] == "> \uFFFD");
  CHECK(plain_picture("1234567\u6f22", 0, 10).wrapped == std::vector<bool>{true, false});  // two cells wide
}

TEST_CASE("word list: groups, and no more rows than there is room for") {
  CHECK(word_list({"dae", "mass", "do"}, kind, {40, 20, false}) ==
        "variables\r\nmass\r\nvocabulary\r\ndae\r\nkeywords\r\ndo\r\n");
  CHECK(word_list({"b", "a"}, {}, {40, 20, false}) == "a  b\r\n");
  CHECK(word_list({"data/x.csv", "data/y/"}, {}, {40, 20, false}) == "x.csv  y/\r\n");
  std::vector<std::string> many;
  for (int i = 0; i < 50; ++i) many.push_back("word" + std::to_string(i));
  const std::string text = word_list(many, {}, {10, 5, false});
  CHECK(std::count(text.begin(), text.end(), '\n') == 5);
  CHECK(text.find("50 words in all") != text.npos);
}

}  // namespace pendula::entry_view_test
