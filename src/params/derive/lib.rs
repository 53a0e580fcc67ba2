//! The macro `#[derive(Parameters)]`, which `dq_params` documents and exports.

use proc_macro2::TokenStream;
use quote::{ToTokens, quote};
use std::collections::HashMap;
use syn::{Attribute, DeriveInput, Error, Expr, ExprLit, Field, Fields, Lit, LitStr, Meta, Token};

/// Declares each field of a struct as a parameter; see `dq_params::Parameters`.
#[proc_macro_derive(Parameters, attributes(parameter, parameters))]
pub fn derive(input: proc_macro::TokenStream) -> proc_macro::TokenStream {
    let input = syn::parse_macro_input!(input as DeriveInput);
    expand(&input).unwrap_or_else(Error::into_compile_error).into()
}

fn expand(input: &DeriveInput) -> syn::Result<TokenStream> {
    let syn::Data::Struct(syn::DataStruct { fields: Fields::Named(fields), .. }) = &input.data else {
        return Err(Error::new_spanned(input, "expected a struct with named fields"));
    };
    let mut prefix = String::new();
    for attribute in input.attrs.iter().filter(|attribute| attribute.path().is_ident("parameters")) {
        attribute.parse_nested_meta(|meta| {
            prefix = meta.value()?.parse::<LitStr>()?.value();
            Ok(())
        })?;
    }
    let fields = fields.named.iter().map(|field| read(field, &prefix)).collect::<syn::Result<Vec<_>>>()?;
    let (name, (generics, types, bounds)) = (&input.ident, input.generics.split_for_impl());
    Ok(quote! {
        impl #generics ::dq_params::Parameters for #name #types #bounds {
            fn declare(p: &mut ::dq_params::Declarer) -> Result<Self, ::dq_params::ParameterError> {
                Ok(Self { #(#fields),* })
            }
        }
    })
}

/// The keywords that the attribute `#[parameter(...)]` may have.
const WORDS: [&str; 7] = ["group", "name", "default", "range", "one_of", "required", "fixed"];

/// Returns the attribute's keywords with their values. The value of a keyword without a value is `None`.
fn said(attribute: &Attribute) -> syn::Result<HashMap<String, Option<Expr>>> {
    let mut said = HashMap::new();
    attribute.parse_nested_meta(|meta| {
        let word = meta.path.require_ident()?.to_string();
        if !WORDS.contains(&word.as_str()) {
            return Err(meta.error(format!("expected one of {}", WORDS.join(", "))));
        }
        let value = if meta.input.peek(Token![=]) { Some(meta.value()?.parse()?) } else { None };
        said.insert(word, value);
        Ok(())
    })?;
    Ok(said)
}

/// Returns the code that initializes the field: the field's name, and an expression that declares and reads its parameter.
fn read(field: &Field, prefix: &str) -> syn::Result<TokenStream> {
    let (ident, kind) = (&field.ident, &field.ty);
    let attribute = field.attrs.iter().find(|attribute| attribute.path().is_ident("parameter"));
    let Some(said) = attribute.map(said).transpose()? else {
        return Ok(quote!(#ident: ::std::default::Default::default()));
    };
    if said.contains_key("group") {
        return Ok(quote!(#ident: <#kind as ::dq_params::Parameters>::declare(p)?));
    }
    let [name, default, range, one_of] =
        ["name", "default", "range", "one_of"].map(|word| said.get(word).and_then(Option::as_ref));
    let [required, fixed] = ["required", "fixed"].map(|word| said.contains_key(word));
    let (description, unit) = description(&field.attrs);
    let own_name = format!("{prefix}{}", ident.to_token_stream());
    let name = name.map_or_else(|| own_name.to_token_stream(), ToTokens::to_token_stream);
    let constraint = match (range, one_of) {
        (Some(range), _) => quote!(::dq_params::Constraint::from(#range)),
        (None, Some(names)) => quote!(::dq_params::Constraint::OneOf(#names)),
        (None, None) => quote!(::dq_params::Constraint::None),
    };
    let default = match (default, one_of) {
        (Some(default), Some(_)) => quote!(::dq_params::Value::from((#default).to_string())),
        (Some(default), None) => quote!(::dq_params::Value::from(#default)),
        (None, _) => quote!(<#kind as ::dq_params::ParameterType>::empty()),
    };
    let read = if one_of.is_some() { quote!(read_name) } else { quote!(read) };
    Ok(quote! {
        #ident: p.#read(::dq_params::Declaration {
            name: #name,
            default: #default,
            constraint: #constraint,
            unit: #unit,
            description: #description,
            read_only: #fixed,
            required: #required,
        })?
    })
}

/// Splits the documentation into a description on one line and a unit. The unit is the text in brackets at the end of the
/// documentation, or an empty string.
fn description(attributes: &[Attribute]) -> (String, String) {
    let line = |attribute: &Attribute| match &attribute.meta {
        Meta::NameValue(meta) if meta.path.is_ident("doc") => match &meta.value {
            Expr::Lit(ExprLit { lit: Lit::Str(text), .. }) => Some(text.value().trim().replace('\\', "")),
            _ => None,
        },
        _ => None,
    };
    let text = attributes.iter().filter_map(line).collect::<Vec<_>>().join(" ");
    match text.strip_suffix(']').and_then(|text| text.rsplit_once(" [")) {
        Some((description, unit)) => (description.to_owned(), unit.to_owned()),
        None => (text, String::new()),
    }
}
