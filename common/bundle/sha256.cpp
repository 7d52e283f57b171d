// SPDX-License-Identifier: Apache-2.0
#include "common/bundle/sha256.h"

#include <openssl/evp.h>
#include <algorithm>
#include <array>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <vector>

namespace gyre {

namespace {

// OpenSSL's, because it uses the processor's own instructions for it, which are five times as fast.
class Sha256 {
 public:
  Sha256() : state_(EVP_MD_CTX_new()) {
    if (!state_ || EVP_DigestInit_ex(state_.get(), EVP_sha256(), nullptr) != 1) std::abort();
  }
  void add(const void* data, std::size_t size) {
    if (EVP_DigestUpdate(state_.get(), data, size) != 1) std::abort();
  }
  std::string hex() {
    std::array<unsigned char, 32> digest{};
    if (EVP_DigestFinal_ex(state_.get(), digest.data(), nullptr) != 1) std::abort();
    constexpr std::string_view digits = "0123456789abcdef";
    std::string text;
    for (const unsigned char byte : digest) {
      text += digits[byte >> 4];
      text += digits[byte & 15];
    }
    return text;
  }

 private:
  struct Free {
    void operator()(EVP_MD_CTX* state) const { EVP_MD_CTX_free(state); }
  };
  std::unique_ptr<EVP_MD_CTX, Free> state_;
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
