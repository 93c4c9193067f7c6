// Overloaded: one visitor of a variant, made of a lambda per alternative.
#pragma once

namespace strandcast {

template <class... Ts>
struct Overloaded : Ts... {
  using Ts::operator()...;
};
template <class... Ts>
Overloaded(Ts...) -> Overloaded<Ts...>;  // Clang 14 needs it said

}  // namespace strandcast
