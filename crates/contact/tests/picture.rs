//! The picture in the documentation is the one that the example draws.

#[path = "../examples/mortar_picture.rs"]
#[allow(dead_code)]
mod mortar_picture;

/// `UPDATE_PAGES=1` writes it.
#[test]
fn the_picture_is_the_examples() {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/figures/mortar.svg");
    let picture = mortar_picture::picture().expect("the surfaces are sound");
    if std::env::var_os("UPDATE_PAGES").is_some() {
        std::fs::write(file, &picture).expect("docs/figures can be written");
    }
    assert_eq!(std::fs::read_to_string(file).expect("docs/figures/mortar.svg"), picture);
}
