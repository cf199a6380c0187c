// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/host/output_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

#include "firmware/config/file_error.hpp"

namespace polygmap::sim {
namespace {

[[noreturn]] void fail(const std::string& path, int error) {
  throw config::FileError("Cannot write \"" + path + "\": " + std::strerror(error) + ".");
}

// Of what was written, the errno of the first failure; 0: all of it is on the disk.
int write_all(int file, std::string_view content) {
  while (!content.empty()) {
    const ssize_t written = ::write(file, content.data(), content.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return errno;
    content.remove_prefix(static_cast<std::size_t>(written));
  }
  return ::fsync(file) == 0 || errno == EINTR || errno == EINVAL || errno == EROFS
             ? 0
             : errno;  // what is no file has nothing to sync
}

// The name is on the disk only once its folder is. A file system that cannot say so is none the worse for it.
void sync_folder_of(const std::filesystem::path& path) {
  const std::string folder = path.has_parent_path() ? path.parent_path().string() : ".";
  const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return;
  (void)::fsync(descriptor);
  (void)::close(descriptor);
}

}  // namespace

void write_output(const std::string& path, std::string_view content) {
  namespace fs = std::filesystem;
  std::error_code none;
  const bool direct = fs::exists(path, none) && !fs::is_regular_file(path, none);
  // A link is followed, and the name beside is of this process alone.
  const std::string whole = direct || !fs::is_symlink(path, none) ? path : fs::weakly_canonical(path, none).string();
  const std::string written = direct ? path : whole + "." + std::to_string(::getpid()) + ".part";
  const int file = ::open(written.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (file < 0) fail(path, errno);
  int error = write_all(file, content);
  if (::close(file) != 0 && error == 0) error = errno;
  if (error == 0 && !direct && ::rename(written.c_str(), whole.c_str()) != 0) error = errno;
  if (error == 0 && !direct) sync_folder_of(whole);
  if (error == 0) return;
  if (!direct) ::unlink(written.c_str());
  fail(path, error);
}

void remove_output(const std::string& path) {
  namespace fs = std::filesystem;
  std::error_code none;
  if (fs::is_symlink(path, none)) {  // the link is its owner's, /dev/stdout for one: what it leads to is emptied
    if (fs::is_regular_file(path, none) && ::truncate(path.c_str(), 0) != 0) fail(path, errno);
    return;
  }
  if (fs::exists(path, none) && !fs::is_regular_file(path, none) && !fs::is_directory(path, none)) return;
  if (::unlink(path.c_str()) != 0 && errno != ENOENT) fail(path, errno);
}

}  // namespace polygmap::sim
