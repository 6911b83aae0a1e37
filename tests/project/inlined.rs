//! Code on a path is compiled with the instructions of its SIMD level.
//!
//! A function or closure that is not inlined into the level's entry point is compiled for the baseline processor
//! instead, where each intrinsic becomes a call. One such closure made a kernel seven times slower, with the same
//! image. The program's disassembly shows these calls.

use std::collections::{BTreeSet, HashMap};
use std::env;
use std::process::Command;

/// Crates with intrinsics of their own.
const OTHERS: [&str; 4] = ["memchr::", "sha2::", "aho_corasick::", "crc32fast::"];

/// The functions in a disassembly that call an AVX intrinsic. Functions of the standard library count, because a
/// closure may be inlined into one, unless only other crates call them.
fn calls_of_intrinsics<'l>(lines: impl Iterator<Item = &'l str>) -> BTreeSet<String> {
    let is_other = |name: &str| OTHERS.iter().any(|other| name.contains(other));
    let (mut function, mut address) = ("", "");
    let mut found = Vec::new();
    // By address: whether other crates call a function, and whether this one does.
    let mut callers: HashMap<&str, [bool; 2]> = HashMap::new();
    for line in lines {
        if let Some((start, name)) = line.strip_suffix(">:").and_then(|line| line.split_once(" <")) {
            (address, function) = (start.trim_start_matches('0'), name);
            continue;
        }
        let Some((before, name)) = line.rsplit_once(" <") else { continue };
        let callee = before.rsplit(char::is_whitespace).next().unwrap_or_default();
        callers.entry(callee).or_default()[usize::from(!is_other(function))] = true;
        // Calls, and jumps at a function's end, but not the intrinsics themselves.
        let is_intrinsic = name.contains("core_arch") && name.contains("avx");
        if is_intrinsic && !function.contains("core_arch") && !is_other(function) {
            found.push((address, format!("{function} calls {}", name.trim_end_matches('>'))));
        }
    }
    let only_of_others = |address: &str| callers.get(address) == Some(&[true, false]);
    found.into_iter().filter(|(address, _)| !only_of_others(address)).map(|(_, call)| call).collect()
}

#[test]
fn no_intrinsic_is_called() {
    let disassembly = Command::new("objdump")
        .args(["--disassemble", "--demangle", "--no-show-raw-insn"])
        .arg(env!("CARGO_BIN_EXE_stride"))
        .output();
    let Ok(disassembly) = disassembly else {
        assert!(env::var("STRIDE_REQUIRE_ALL").as_deref() != Ok("1"), "there is no objdump");
        println!("skipped: there is no objdump (Debian's package binutils)");
        return;
    };
    if !cfg!(target_arch = "x86_64") {
        println!("skipped: only x86-64 has levels with intrinsics");
        return;
    }
    assert!(disassembly.status.success(), "{}", String::from_utf8_lossy(&disassembly.stderr));
    let text = String::from_utf8_lossy(&disassembly.stdout);
    for entry in ["run_avx2", "run_avx512"] {
        assert!(text.contains(entry), "no kernel of {entry} was found: are there symbols?");
    }
    let found = calls_of_intrinsics(text.lines());
    assert!(
        found.is_empty(),
        "compiled without their level's instructions (mark them #[inline(always)]): {found:#?}"
    );
}

/// Negative control.
#[test]
fn calls_of_intrinsics_are_detected() {
    let listing = "
00000000003f4a30 <core::core_arch::x86::avx::_mm256_add_ps>:
  3f4a30:	vaddps (%rsi),%ymm0,%ymm0
0000000000560000 <stride::math::lanes::level::run_avx2>:
  560010:	call   561000 <stride::shape::triangle::exact_difference::{{closure}}>
0000000000561000 <stride::shape::triangle::exact_difference::{{closure}}>:
  561010:	call   3f4a30 <core::core_arch::x86::avx::_mm256_add_ps>
0000000000561800 <core::array::<impl [T; N]>::try_map>:
  561810:	call   3f4a30 <core::core_arch::x86::avx::_mm256_set1_ps>
0000000000561a00 <core::array::<impl [T; N]>::try_map>:
  561a10:	call   3f4a30 <core::core_arch::x86::avx::_mm256_set1_ps>
0000000000561b00 <aho_corasick::packed::teddy::new>:
  561b10:	call   561a00 <core::array::<impl [T; N]>::try_map>
0000000000561c00 <core::array::<impl [T; N]>::map>:
  561c10:	call   3f4a30 <core::core_arch::x86::avx::_mm256_set1_ps>
0000000000561d00 <aho_corasick::packed::teddy::other>:
  561d10:	call   561c00 <core::array::<impl [T; N]>::map>
0000000000561e00 <stride::shape::triangle::all>:
  561e10:	call   561c00 <core::array::<impl [T; N]>::map>
0000000000562000 <memchr::arch::x86_64::avx2::memchr::One::rfind_raw>:
  562010:	call   3f4a30 <core::core_arch::x86::avx2::_mm256_cmpeq_epi8>
";
    let found = calls_of_intrinsics(listing.lines());
    assert_eq!(found.len(), 3, "{found:?}");
    for function in ["exact_difference", "::try_map", "::map"] {
        assert!(found.iter().any(|call| call.contains(function)), "{found:?}");
    }
}
