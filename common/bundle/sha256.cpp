// SPDX-License-Identifier: Apache-2.0
#include "common/bundle/sha256.h"

#include <sodium.h>
#include <algorithm>
#include <array>
#include <fstream>
#include <vector>

namespace gyre {

namespace {

class Sha256 {
 public:
  Sha256() { crypto_hash_sha256_init(&state_); }
  void add(const void* data, std::size_t size) {
    crypto_hash_sha256_update(&state_, static_cast<const unsigned char*>(data), size);
  }
  std::string hex() {
    std::array<unsigned char, crypto_hash_sha256_BYTES> digest{};
    crypto_hash_sha256_final(&state_, digest.data());
    std::string text(2 * digest.size() + 1, '\0');
    sodium_bin2hex(text.data(), text.size(), digest.data(), digest.size());
    text.pop_back();
    return text;
  }

 private:
  crypto_hash_sha256_state state_{};
};

}  // namespace

std::string sha256(std::span<const std::byte> bytes) {
  Sha256 hash;
  hash.add(bytes.data(), bytes.size());
  return hash.hex();
}

std::string sha256(std::string_view text) {
  return sha256(std::as_bytes(std::span(text.data(), text.size())));
}

Result<std::string> sha256_of_file(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) return fail("cannot read", file.string());
  Sha256 hash;
  std::vector<char> block(1 << 16);
  while (in) {
    in.read(block.data(), static_cast<std::streamsize>(block.size()));
    hash.add(block.data(), static_cast<std::size_t>(in.gcount()));
  }
  if (in.bad()) return fail("cannot read", file.string());
  return hash.hex();
}

Result<std::string> sha256_of_folder(const std::filesystem::path& folder, std::string_view except) {
  std::vector<std::filesystem::path> files;
  std::error_code error;
  for (auto it = std::filesystem::recursive_directory_iterator(folder, error);
       !error && it != std::filesystem::recursive_directory_iterator(); it.increment(error)) {
    if (it->is_regular_file(error) && it->path().filename() != except) files.push_back(it->path());
  }
  if (error) return fail("cannot list", folder.string() + " (" + error.message() + ")");
  std::sort(files.begin(), files.end());
  Sha256 hash;
  for (const std::filesystem::path& file : files) {
    const Result<std::string> digest = sha256_of_file(file);
    if (!digest) return tl::unexpected(digest.error());
    const std::string line = file.lexically_relative(folder).generic_string() + '\0' + *digest + '\n';
    hash.add(line.data(), line.size());
  }
  return hash.hex();
}

}  // namespace gyre
