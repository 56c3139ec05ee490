"""What a module imports, by its text alone."""
import ast


def imported_modules(source, package):
    """Absolute names of all modules that a piece of source text imports, at any depth of nesting."""
    names = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            base = '.'.join([package] * (node.level > 0) + [node.module] * (node.module is not None))
            names |= {base} | {f'{base}.{alias.name}' for alias in node.names}
        elif isinstance(node, ast.Call) and getattr(node.func, 'attr', getattr(node.func, 'id', '')) in (
                'import_module', '__import__'):
            names.add('a module by a name that is made at run time')
    return names
