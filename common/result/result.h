// SPDX-License-Identifier: Apache-2.0
// Result<T>: a value, or an error that says what failed, where, and what to do about it.
#pragma once

#include <string>
#include <tl/expected.hpp>
#include <utility>

namespace gyre {

// A failure that can happen in normal use (a file, a peer, a camera). Programming mistakes are asserts instead.
struct Error {
  enum class Kind {
    failed,  // exit code 1: the world did not cooperate
    usage,   // exit code 2: the request itself was wrong
  };
  std::string what;    // what failed: "cannot read keyframe"
  std::string where;   // on what: a path, a peer, a frame; may be empty
  std::string remedy;  // what to do: "free some space and run again"; may be empty
  Kind kind = Kind::failed;

  // One line: "what: where; remedy".
  std::string message() const {
    std::string line = what;
    if (!where.empty()) line += ": " + where;
    if (!remedy.empty()) line += "; " + remedy;
    return line;
  }
  int exit_code() const { return kind == Kind::usage ? 2 : 1; }
};

template <class T>
using Result = tl::expected<T, Error>;

// Both return an error ready to be returned from a function whose type is any Result<T>.
inline tl::unexpected<Error> fail(std::string what, std::string where = {}, std::string remedy = {}) {
  return tl::unexpected<Error>(Error{std::move(what), std::move(where), std::move(remedy), Error::Kind::failed});
}
inline tl::unexpected<Error> wrong_use(std::string what, std::string where = {}, std::string remedy = {}) {
  return tl::unexpected<Error>(Error{std::move(what), std::move(where), std::move(remedy), Error::Kind::usage});
}

}  // namespace gyre
