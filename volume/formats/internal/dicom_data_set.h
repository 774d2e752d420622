// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

/// The elements of a DICOM file (DICOM PS3.5, PS3.10), found by walking its structure. This comes
/// before any library: GDCM takes minutes over some damaged files, accepts others, and asks for the
/// memory that an absurd header states.
namespace palpate::internal {

/// group << 16 | element
using DicomTag = std::uint32_t;

/// How a file's bytes are to be understood.
struct DicomSyntax {
    std::string uid; ///< transfer syntax; empty when the file states none
    bool explicit_vr = true;
    bool big_endian = false;
    bool compressed = false; ///< pixels are encapsulated: JPEG, RLE ...
    bool known = true;       ///< false: cannot be walked or decoded
};

struct DicomElement;

/// Elements in the order of the file. Values are views into the bytes of their DicomFile.
struct DicomDataSet {
    std::vector<DicomElement> elements;
    bool big_endian = false;

    /// The element of that tag; nullptr when there is none.                            [any]
    const DicomElement* find(DicomTag tag) const noexcept;
    /// Its text without padding, in printable ASCII (others become '?'); empty when it is missing.
    /// [any]
    std::string text(DicomTag tag) const;
    /// Its first number as 16-bit unsigned.                                             [any]
    std::optional<std::uint16_t> us(DicomTag tag) const noexcept;
    /// Its numbers as 16-bit unsigned; empty when it is missing.                         [any]
    std::vector<std::uint16_t> shorts(DicomTag tag) const;
    /// Its first number as 32-bit unsigned.                                             [any]
    std::optional<std::uint32_t> ul(DicomTag tag) const noexcept;
    /// Numbers of a decimal or integer string, all finite; empty when missing or unreadable. [any]
    std::vector<double> decimals(DicomTag tag) const;
    /// Numbers of 64-bit floats, all finite; empty when missing or unreadable.          [any]
    std::vector<double> doubles(DicomTag tag) const;
    /// The first item of a sequence; nullptr when there is none.                        [any]
    const DicomDataSet* item(DicomTag tag) const noexcept;
    /// The items of a sequence.                                                          [any]
    std::span<const DicomDataSet> items(DicomTag tag) const noexcept;
    /// A name in UTF-8 without padding; what is not printable, or in a character set other than
    /// ASCII, Latin-1 and UTF-8, becomes '?'. `root` says which set (0008,0005).        [any]
    std::string name(DicomTag tag, const DicomDataSet& root) const;
};

struct DicomElement {
    DicomTag tag = 0;
    std::array<char, 2> vr{' ', ' '}; ///< representation; blanks in an implicit syntax
    std::span<const char> value;      ///< of encapsulated pixels: items with their headers
    bool encapsulated = false;        ///< pixels in fragments
    std::vector<DicomDataSet> items;  ///< of a sequence that was walked
};

/// A DICOM file, its bytes and its elements.
struct DicomFile {
    std::vector<char> bytes; ///< as walked: inflated where the syntax is the deflated one
    DicomSyntax syntax;
    DicomDataSet meta; ///< group 0002
    DicomDataSet data; ///< as far as it was sound
    std::string
        problem; ///< what is wrong with the structure, as "is truncated ...": empty if sound
};

/// True when the first bytes of a file announce DICOM: the magic number, or (older files have none)
/// a first element of group 0002 or 0008.                                               [any]
bool begins_as_dicom(std::span<const char> beginning) noexcept;

/// True when the magic number is there.                                                 [any]
bool has_dicom_magic(std::span<const char> beginning) noexcept;

/// Bytes that begins_as_dicom() wants to see.
constexpr std::size_t kDicomBeginning = 140;

/// Reads a file and walks it. Damage is not thrown but said in `problem`.               [setup]
/// Throws import_error when the file cannot be opened or does not fit into memory.
DicomFile read_dicom_file(const std::filesystem::path& file);

/// The unique identifier of the kind of object that a file holds (its storage class), from the
/// first bytes of the file; empty where it is no DICOM, or does not say.                [setup]
std::string dicom_class_of(const std::filesystem::path& file);

} // namespace palpate::internal
