// SPDX-License-Identifier: Apache-2.0
// A pipe from a child process to this one.
#pragma once

#include <array>
#include <string>

namespace gyre {

class ChildPipe {
 public:
  ChildPipe() = default;
  ChildPipe(const ChildPipe&) = delete;
  ChildPipe& operator=(const ChildPipe&) = delete;
  ~ChildPipe();

  bool open();                              // false: errno says why
  int reading() const { return ends_[0]; }  // -1 once everything was read
  int writing() const { return ends_[1]; }  // for the child
  void close_writing() { close_end(1); }    // once the child has it
  void read_into(std::string& text);        // appends what is there; closes at the end

 private:
  void close_end(std::size_t which);
  std::array<int, 2> ends_{-1, -1};
};

}  // namespace gyre
