#include "lua/document/licences.hpp"

#include <string_view>

#include "base/text.hpp"

namespace pendula::lua {
namespace {

struct Part {
  std::string_view name;  ///< as in PENDULA_PARTS, the list of components of this build
  std::string_view text;
};

constexpr Part parts[] = {
    {"lua", "Lua 5.4 (liblua5.4-c++): MIT. © Lua.org, PUC-Rio"},
    {"eigen", "Eigen 3.4 (headers): MPL-2.0. © Benoît Jacob, Gaël Guennebaud and others"},
    {"gmp", "GMP (libgmp, libgmpxx): LGPL-3.0-or-later or GPL-2.0-or-later. © Free Software Foundation"},
    {"klu",
     "SuiteSparse (libklu, libbtf, libsuitesparseconfig: LGPL-2.1-or-later or BSD-3-Clause; libamd, libcolamd: "
     "BSD-3-Clause). © Timothy A. Davis, Eka Palamadai and others"},
    {"flint",
     "FLINT (libflint, opened when polynomials are factored, with libmpfr: LGPL-3.0-or-later, libntl: "
     "LGPL-2.1-or-later): LGPL-2.1-or-later. Debian's libntl loads libgf2x: GPL-2.0-or-later; "
     "cmake -DPENDULA_FLINT=OFF builds without it. © William Hart, Fredrik Johansson and others"},
    {"sqlite", "SQLite (libsqlite3): public domain"},
    {"zlib", "zlib (libz): Zlib. © Jean-loup Gailly and Mark Adler"},
    {"asmjit", "AsmJit (libasmjit): Zlib. © Petr Kobalicek"},
    {"sleef", "SLEEF (libsleef): BSL-1.0. © Naoki Shibata and contributors"},
    {"readline",
     "GNU Readline (libreadline, libtinfo of ncurses: X11): GPL-3.0-or-later, which therefore binds this program "
     "as a whole; cmake -DPENDULA_READLINE=OFF builds without it. © Free Software Foundation"},
    {"matio", "matio (libmatio, opened when a MATLAB file is read): BSD-2-Clause. © Christopher C. Hulbert"},
    {"xeus",
     "xeus (libxeus, with libzmq: MPL-2.0, nlohmann-json: MIT; in pendula-kernel): BSD-3-Clause. © QuantStack"},
    {"font",
     "Latin Modern Math, a subset of its signs in pages with mathematics: GUST Font License (LPPL-1.3c-or-later). "
     "© B. Jackowski, P. Strzelczyk and P. Pianowski"},
};

}  // namespace

std::string licences_text() {
  const auto present = split_words(PENDULA_PARTS);
  std::string text = "This program contains or loads:\n\n";
  for (const Part& part : parts)
    for (const std::string& name : present)
      if (name == part.name) text += std::string(part.text) + "\n\n";
  return text +
         "libstdc++ and libgcc: GPL-3.0-or-later with the GCC Runtime Library Exception. glibc: LGPL-2.1-or-later.\n"
         "gnuplot, chromium and other programs are started where they are installed and are not part of it.\n";
}

}  // namespace pendula::lua
