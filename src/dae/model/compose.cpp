#include "dae/model/compose.hpp"

#include <algorithm>

#include "base/error.hpp"
#include "base/text.hpp"
#include "expr/print/print.hpp"

namespace pendula::dae {
namespace {

bool is_law(const Block& block) {
  const auto is_input = [](Expr e) {
    return e.is_symbol() && symbol_of(e).kind == Kind::input && symbol_of(e).order == 0;
  };
  return block.lhs.size() > 0 && block.lhs.size() == block.rhs.size() &&
         std::all_of(block.lhs.begin(), block.lhs.end(), is_input);
}

/// Removes the equations for inputs from `blocks` and returns them.
Substitution take_laws(std::vector<Block>& blocks) {
  Substitution laws;
  std::vector<Block> others;
  for (Block& block : blocks) {
    if (!is_law(block)) {
      others.push_back(std::move(block));
      continue;
    }
    for (Eigen::Index i = 0; i < block.lhs.size(); ++i)
      if (!laws.try_emplace(block.lhs[i], block.rhs[i]).second)
        throw Error(text("there are two equations for the input '", to_text(block.lhs[i]), "'"));
  }
  blocks = std::move(others);
  return laws;
}

bool mentions(Expr e, const Substitution& laws) {
  const std::vector<Expr> inside = leaves({&e, 1});
  return std::any_of(inside.begin(), inside.end(), [&](Expr leaf) {
    const Symbol& s = symbol_of(leaf);
    return s.kind == Kind::input && laws.count(s.base) != 0;
  });
}

/// Substitutes the laws of inputs and their derivatives into e.
Expr put_in(Expr e, const Substitution& laws) {
  Substitution all;
  for (Expr leaf : leaves({&e, 1})) {
    const Symbol& s = symbol_of(leaf);
    if (s.kind != Kind::input) continue;
    if (const auto law = laws.find(s.base); law != laws.end())
      all[leaf] = s.order == 0 ? law->second : total_derivative(law->second, s.order);
  }
  return all.empty() ? e : substitute(e, all);
}

/// Expands laws that contain other inputs with laws; each round resolves one step of a chain F ~ k*G, G ~ x.
void resolve_chains(Substitution& laws) {
  const auto open = [&] {
    return std::find_if(laws.begin(), laws.end(),
                        [&](const auto& law) { return mentions(law.second, laws); });
  };
  for (std::size_t round = 0; round < laws.size() && open() != laws.end(); ++round) {
    const Substitution before = laws;
    for (auto& [input, law] : laws) law = put_in(law, before);
  }
  if (open() == laws.end()) return;
  std::vector<std::string> names;
  for (const auto& [input, law] : laws)
    if (mentions(law, laws)) names.push_back(to_text(input));
  std::sort(names.begin(), names.end());
  throw Error(text("the equations for the inputs ", join(names, ", "),
                   " form a cycle; declare one of them as a variable: var \"", names[0], "\""));
}

void add_part(const Model& part, std::vector<Block>& blocks, ModelOptions& options) {
  if (!part.form.empty())
    throw Error(
        text("reduce(\"", part.form,
             "\") made this part; use the model before reduce as the part, and reduce the whole model"));
  blocks.insert(blocks.end(), part.blocks.begin(), part.blocks.end());
  for (const auto& [leaf, meaning] : part.relations) options.relations[leaf] = meaning;
  options.events.insert(options.events.end(), part.events.begin(), part.events.end());
  const auto append = [](auto& list, const auto& more) {
    list.insert(list.begin(), more.begin(), more.end());
  };
  append(options.start_values, part.start_values);
  append(options.start_guesses, part.start_guesses);
  for (const auto& [parameter, value] : part.values) {
    const auto [at, made] = options.values.try_emplace(parameter, value);
    if (!made && at->second != value)
      throw Error(text("the parameter '", to_text(parameter), "' has the value ", to_text(at->second),
                       " in one part and ", to_text(value), " in another one"));
  }
}

}  // namespace

ModelPtr compose(const std::vector<ModelPtr>& parts, std::vector<Block> blocks, ModelOptions options) {
  Substitution laws = take_laws(blocks);
  resolve_chains(laws);
  std::vector<Block> all;
  for (const ModelPtr& part : parts) add_part(*part, all, options);
  all.insert(all.end(), std::make_move_iterator(blocks.begin()), std::make_move_iterator(blocks.end()));
  if (!laws.empty()) {
    for (Block& block : all)
      for (VecX* side : {&block.lhs, &block.rhs})
        for (Expr& e : *side) e = put_in(e, laws);
    for (auto& [leaf, meaning] : options.relations) meaning = put_in(meaning, laws);
    for (const auto& [input, law] : laws) options.relations[input] = law;
  }
  return make_model(std::move(all), std::move(options));
}

}  // namespace pendula::dae
