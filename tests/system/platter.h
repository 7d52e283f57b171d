// SPDX-License-Identifier: Apache-2.0
// What a disk is sure to hold when its power goes: of every file and folder below a root, what it was at its last sync.
// sync_shim.cpp writes it down from within a program, power_cut_test.cpp takes the root back to it.
//
// A file's bytes are there as they were at the last fsync of the file, and its name as the folder listed it at the last
// fsync of the folder. That is the least that POSIX promises; file systems keep more, each its own way, and a program
// that is right here is right on all of them.
#pragma once

#include <filesystem>
#include <map>
#include <random>
#include <string>

namespace gyre {

class Platter {
 public:
  // folder: where this is kept, outside of root; both exist.
  Platter(std::filesystem::path folder, std::filesystem::path root);

  // An open file or folder was synced. Nothing when it is not below the root. False: it could not be written down.
  bool sync(int fd) const;

  // Everything below the root is on the disk as it is.
  void sync_all() const;

  // Makes the root what a disk holds after a power cut, and that the new beginning. Nothing that was not synced is left
  // when `random` is null; else some of it is, as chance will have it: later names in a folder, the beginning of what
  // was written to a file, zeros after that.
  void cut(std::mt19937* random) const;

 private:
  struct Live;
  bool keep(const std::filesystem::path& path) const;
  void build(const std::string& key, const std::filesystem::path& to, const Live& live, std::mt19937* random) const;
  std::string bytes(const std::string& key, const Live& live, std::mt19937* random) const;

  std::filesystem::path folder_, root_;
};

}  // namespace gyre
